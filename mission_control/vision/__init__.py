"""Published algorithms, one in each file: arrays go in, arrays come out."""
