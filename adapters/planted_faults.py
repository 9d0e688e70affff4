"""What the bench is known to catch: faults that were planted in a healthy toy engine, and what caught each.

The tests plant every one of them; the report shows the table, so that a reader knows how far "all receipts hold" goes.
"""

#: Fault -> what catches it: a receipt by its quantity, or a conformance check.
CAUGHT_BY = {
    "restitution ignored": "receipt restitution",
    "friction applied twice": "receipt friction",
    "friction 2 % low": "receipt friction",
    "impulses reported 2 % low": "receipt impulse",
    "friction reported 2 % low": "receipt friction_impulse",
    "gravity sign": "receipt gravity",
    "half against full extents": "receipt size",
    "state sampled one step late": "receipt sampling",
    "world shared between builds": "check fresh",
    "disc inertia given to a sphere": "receipt inertia",
    "hidden damping of 4 %": "receipt linear_damping",
    "angle sign": "receipt turn",
    "mass ignored": "receipt mass",
    "impulse of the wrong body": "check impulse",
    "torque sign": "receipt turn",
    "step of its own": "receipt step",
    "spin damped": "receipt angular_damping",
    "principal axes swapped": "receipt inertia",
    "start not as the scene says": "check states",
    "bodies in another order": "check states",
    "normal points from the second body": "check contacts",
    "bodies not in order of the scene": "check contacts",
    "unknown settings ignored": "check refusals",
    "setting without a reason": "check profiles",
    "refusal of several lines": "check refusals",
    "nothing read back": "check readback",
}
