"""A walking robot with four legs and twelve servos, the size of a small AIBO: 0.28 m long, 0.2 m high, 2.1 kg.

``body`` has the body and the on-board program (a servo board); ``link`` has the packets. The motion control
(``motion``) runs off board. Fifty times a second it turns the requested speeds into foot curves (``gait``), and these
into joint targets (``kinematics``). The newest targets go to the board twenty times a second.

The gait follows Hengst, Ibbotson, Pham, Sammut, "Omnidirectional Locomotion for Quadruped Robots", RoboCup 2001, and
the MotionControl of Petters, Thomas, von Stryk, RoboFrame, 2006, section IV.

Measured in MuJoCo over twenty seeds, each with its own friction (0.5 to 1), heading, noise of the servos and three
pushes of 0.15 m/s; medians, and the greatest tilt of the trunk:

| gait, request | reached | tilt | falls |
|---|---|---|---|
| trot, 0.3 m/s | 0.28 m/s, 2.5 degrees off its direction, 13 at most | 10 degrees | 0 |
| trot, 0.2 m/s and 0.6 rad/s | half a circle of 0.30 m, 182 degrees | 9 degrees | 0 |
| trot, 1.2 rad/s on the spot | 1.2 rad/s, 3 cm aside at most | 6 degrees | 0 |
| trot, 1.8 rad/s on the spot | 1.8 rad/s, 4 cm aside at most | 7 degrees | 0 |
| walk, 0.1 m/s | 0.10 m/s, 4 degrees off its direction, 7 at most | 4 degrees | 0 |
"""
