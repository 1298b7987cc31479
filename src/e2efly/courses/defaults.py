"""The courses on which policies are trained and judged, and smaller ones, which fit into a room of 4x4 m and are flown
unless another course is requested. A policy knows its place only relative to its course.
"""

TARGET = (0.0, 0.0, 3.0)
"""Hover: position, world, m."""
CENTRE = (0.0, 0.0, 3.0)
"""Centre of the circle and of the lemniscate, world, m."""
RADIUS = 2.0
"""Radius of the circle, and half the length of the lemniscate, m."""
CIRCLE_RATE = 0.6283185307179586
"""Angular rate of the circle, rad/s. One turn takes 10 s."""
LEMNISCATE_SPEED = 3.0
"""Top speed of the lemniscate, m/s."""
FLOWN_HEIGHT = 1.2
"""Height of the target, of the circle and of the lemniscate, and at which a landing begins, in flight, m."""
FLOWN_RADIUS = 1.2
"""Radius of the circle, and half the length of the lemniscate, in flight, m."""
FLOWN_CIRCLE_RATE = 0.9
"""Angular rate of the circle in flight, rad/s. One turn takes 7 s, at 1.1 m/s."""
FLOWN_LEMNISCATE_SPEED = 1.8
"""Top speed of the lemniscate in flight, m/s."""
TRACK = "four_gates"
"""The race track."""
HOVER_FENCE = 6.0
"""An episode fails farther than this from the target, m."""
LAND_FENCE = 6.0
"""An episode fails farther than this from the pad, sideways or upwards, m."""
TRACK_FENCE = 3.0
"""An episode fails farther than this from the reference, m."""
RACE_FENCE = 10.0
"""An episode fails farther than this from the next gate, m."""
TRACKS = ("room_4", "room_6", "room_10", "four_gates", "circle_3d", "s_shaped", "j_shaped")
"""The tracks on which policies learn to race at a commanded speed."""
ROOMS = {"room_4": (4.0, 2.5), "room_6": (6.0, 2.5), "room_10": (10.0, 3.0)}
"""Side and height of the room that a track is made for, m. The room is square, and the track's origin is its middle."""
