"""Columns of the arrays in state.py.

A kernel that is handed dozens of arrays compiles and runs several times slower than one that is handed a few (every
call passes seven words per array), and a row's numbers belong together in memory: so a body and a contact row are
each one row of a two-dimensional array, and these are the names of the columns.
"""

# Bodies.kind, integers.
#: Shape code.
SHAPE = 0
#: Motion code.
MOTION = 1
#: First vertex of the body's core in `Bodies.vertex`, and how many (0: half-space, 1: disc, 2: capsule).
FIRST_VERTEX, VERTICES = 2, 3
BODY_INTEGERS = 4

# Bodies.real.
#: Cosine and sine of the angle.
COS, SIN = 0, 1
#: M^-1 f of gravity and constant loads: three columns [m/s^2, m/s^2, rad/s^2].
LOAD = 2
#: 0 unless the body is free.
INVERSE_MASS = 5
#: 0 unless the body is free, and 0 throughout where rotation is left out.
INVERSE_INERTIA = 6
#: Three columns: disc (radius, ., .), box (half extents, .), half-space (normal, offset) [m]; zeros for others.
SIZE = 7
#: Smallest half width [m].
EXTENT = 10
#: By how much the core is grown: all that is within this of the polygon of its vertices is the body [m].
ROUNDING = 11
#: Largest distance of a point of the body from its centre of mass [m]; infinite for a half-space.
REACH = 12
BODY_REALS = 13

# Rows.integer, integers.
#: Bodies, A < B.
A, B = 0, 1
#: Which features touch.
FEATURE = 2
#: 1 where bodies meet or part faster than the loads of one step explain.
IMPACT = 3
ROW_INTEGERS = 4

# Rows.real.
#: Normal from A to B; the tangent is the normal turned by +90 degrees.
NX, NY = 0, 1
#: r_A x n, r_B x n, r_A x t, r_B x t (E2) [m].
AN, BN, AT, BT = 2, 3, 4, 5
#: 1 / k_n and 1 / k_t (E3).
NORMAL_MASS, TANGENT_MASS = 6, 7
#: k_nt (E3).
COUPLING = 8
#: b_n (E7) [m/s].
TARGET = 9
#: mu.
FRICTION = 10
#: Accumulated normal and tangential impulse [N s].
PN, PT = 11, 12
#: u_n before forces (E6) [m/s].
APPROACH = 13
#: The pseudo-velocity to reach, and the accumulated pseudo-impulse (E16).
PUSH_TARGET, PUSH = 14, 15
#: A sweep reads the columns up to here and no others; a multiple of the lanes.
WIDE_REALS = 16
#: Reference speed of the residual (E14) [m/s].
SPEED = 16
#: Separation [m], < 0 overlap.
GAP = 17
#: Contact point minus centre of A and of B [m]: two columns each.
ARM_A, ARM_B = 18, 20
#: Contact point in world axes, for records only [m]: two columns.
POINT = 22
ROW_REALS = 24
