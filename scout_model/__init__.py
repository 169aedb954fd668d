"""The Scout, its room and its radio links, in MuJoCo; knows no task and no bus."""
