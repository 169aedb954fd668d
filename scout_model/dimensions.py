"""Numbers of the Scout, its room and its links, each with its source.

``scout.xml`` and ``room.xml`` repeat these numbers, because MuJoCo needs them as text; a test compares both with this
file. "measured" means: adjusted in MuJoCo until the body behaves as in the papers.
"""

from __future__ import annotations

import math

# Body
BODY_LENGTH_M = 0.110  # RAM 2002, "Robots for Surveillance and Reconnaissance": 11 cm long
BODY_DIAMETER_M = 0.040  # RAM 2002, same place: 4 cm wide; IROS 2001, section 2: 4 cm in diameter
BODY_MASS_KG = 0.200  # RAM 2002, same place: approximately 200 g
WHEEL_RADIUS_M = BODY_DIAMETER_M / 2  # chosen: the wheels are the widest part, so they carry the body's diameter
WHEEL_THICKNESS_M = 0.012  # chosen: leaves 86 mm of the length for the shell between the wheels
TRACK_M = BODY_LENGTH_M - WHEEL_THICKNESS_M  # between the middles of the wheels

# Drive
WHEEL_SPEED_LIMIT_RAD_S = 17.5  # chosen: 0.35 m/s, a brisk pace for 4 cm wheels; the papers give no speed
WHEEL_TORQUE_LIMIT_N_M = 0.009  # measured: climbs the 20 degrees of IROS 2001, section 2, but slips at 22
WHEEL_FRICTION = 0.45  # measured: same

# Spring foot; RAM 2002 and IROS 2001, section 2: jumps over objects 30 cm in height
JUMP_CLEARANCE_M = 0.30  # IROS 2001, section 2
FOOT_STROKE_M = 0.060  # chosen: folds into the body's diameter and length
FOOT_FORCE_N = 22.0  # measured: lifts 200 g to half a metre over this stroke
FOOT_ANGLE_RAD = math.radians(17.0)  # measured: behind the vertical; carries the body forward over the obstacle
FOOT_PRELOAD_M = 0.006  # measured: brings the foot to the floor; a kick through air is wasted on the foot
PRELOAD_S = 0.3  # chosen: time for the winch to lower the foot
KICK_S = 0.12  # chosen: three times what the stroke needs, ends well before landing
WINCH_SPEED_M_S = 0.03  # chosen: two seconds to wind the spring again

# Camera
PICTURE_WIDTH_PX = 320  # chosen: quarter of the analog picture, what cheap framegrabbers deliver at full rate
PICTURE_HEIGHT_PX = 240  # chosen: same
HORIZONTAL_VIEW_RAD = math.radians(40.0)  # chosen: the papers say "narrow"; fits the published detection rates
VERTICAL_VIEW_RAD = 2 * math.atan(math.tan(HORIZONTAL_VIEW_RAD / 2) * PICTURE_HEIGHT_PX / PICTURE_WIDTH_PX)
CAMERA_TILT_RAD = math.radians(4.0)  # chosen: with a level camera, half the picture would be floor

# Time
STEP_S = 1 / 240  # measured: the longest step at which the jump stays within 5 % of its height
STEPS_PER_FRAME = 8
FRAMES_PER_S = 30  # RAM 2002, "Visual Servoing": close to 30 frames per second
COMMAND_TIMEOUT_S = 0.5  # chosen: a robot without commands must neither move nor jam the air

# Battery
IDLE_W = 0.3  # chosen: two small processors and a radio receiver
TRANSMITTER_W = 1.0  # chosen: camera and analog transmitter
MOTORS_W = 1.5  # chosen: two small geared motors, stalled
BATTERY_J = 7 * 24 * 3600 * (IDLE_W + TRANSMITTER_W + MOTORS_W)  # chosen: a week of all that; outlasts every experiment

# Targets
PIONEER_RADIUS_M = 0.20  # chosen: a Pioneer is 38 to 45 cm wide and long
PIONEER_HEIGHT_M = 0.24  # chosen: a Pioneer's top plate
PERSON_HEIGHT_M = 1.75  # chosen: an adult
PERSON_HIP_M = 0.88  # chosen: half the height
PERSON_HIP_WIDTH_M = 0.20  # chosen: between the legs' middles
PERSON_STRIDE_M = 1.4  # chosen: two steps of an adult
PERSON_SWING_RAD = math.radians(25.0)  # chosen: hip angle that goes with this stride

# Carrier: the robot that brings Scouts in; IROS 2001, section 5: deployed by a human or another robot
CARRIER_LENGTH_M = 0.60  # chosen: room for six Scouts side by side in two rows
CARRIER_WIDTH_M = 0.46  # chosen: passes doors
CARRIER_DECK_M = 0.30  # chosen: height of the deck the Scouts ride on
CARRIER_PLACES = 6  # chosen: three rows of two
SET_DOWN_S = 3.0  # chosen: an arm lifts a Scout off, reaches out and lowers it
NEAREST_SET_DOWN_M = 0.45  # chosen: from the carrier's path, so that it does not run over a Scout
FARTHEST_SET_DOWN_M = 1.2  # chosen: reach of its arm

# Landmark; RAM 2002, "Visual Servoing", figure 7: a target of four circles; arrangement and sizes are chosen
BLOB_DIAMETER_M = 0.04  # chosen: nine pixels at two metres
BLOB_PITCH_M = 0.06  # chosen: gaps of half a blob between blobs
BOARD_WIDTH_M = 0.28  # chosen: white around the pattern, a blob's diameter and more to each side
BOARD_HEIGHT_M = 0.17  # chosen: same, standing on the floor
BOARD_THICKNESS_M = 0.01  # chosen: cardboard on a frame
BLOB_PATTERN_HEIGHT_M = 0.075  # chosen: middle of the pattern above the floor; seen from close by, it fills the picture
BLOBS_M = (
    (-BLOB_PITCH_M, BLOB_PATTERN_HEIGHT_M + BLOB_PITCH_M / 2),
    (0.0, BLOB_PATTERN_HEIGHT_M + BLOB_PITCH_M / 2),
    (BLOB_PITCH_M, BLOB_PATTERN_HEIGHT_M + BLOB_PITCH_M / 2),
    (0.0, BLOB_PATTERN_HEIGHT_M - BLOB_PITCH_M / 2),
)
"""Centers of the blobs, which form a T: metres to the right as seen when facing the board, and above the floor."""

# Room
DARKNESS = 0.25  # chosen: share of the light that reaches a dark place; a picture of one is clearly the darkest
WALL_HEIGHT_M = 2.5  # chosen: fills the picture from 9 m away at this view and tilt
TABLE_TOP_M = 0.03  # chosen: a board
TABLE_LEG_M = 0.05  # chosen: a Scout sees it and passes beside it
