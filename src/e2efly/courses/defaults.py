"""The courses that policies are trained and judged on, and that are flown when nothing else is asked for."""

TARGET = (0.0, 0.0, 3.0)
"""Hover: where, world, m."""
CENTRE = (0.0, 0.0, 3.0)
"""Centre of the circle and of the lemniscate, world, m."""
RADIUS = 2.0
"""Circle: radius; lemniscate: half its length, m."""
CIRCLE_RATE = 0.6283185307179586
"""Circle: angular rate, rad/s; a turn takes 10 s."""
LEMNISCATE_SPEED = 3.0
"""Lemniscate: top speed, m/s."""
TRACK = "four_gates"
"""The race track."""
HOVER_FENCE = 6.0
"""Farther than this from the target an episode fails, m."""
LAND_FENCE = 6.0
"""Farther than this from the pad, sideways or up, an episode fails, m."""
TRACK_FENCE = 3.0
"""Farther than this from the reference an episode fails, m."""
RACE_FENCE = 10.0
"""Farther than this from the next gate an episode fails, m."""
