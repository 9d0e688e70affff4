"""The step of the located scheme, told once for both dimensions.

Between steps pose, twist and time are the whole state. Inside a step every contact island has a clock of its own:

    touching rows -> impacts (E21) -> force phase -> path of every body -> first event -> islands it concerns, again

A *force phase* is either the frozen solve (E19), where the rows of all contacts stay what they are along its path, or
one Dormand-Prince step of ``q' = v, M v' = f + F(q) lambda`` with the modes of its contacts held (``lasting.py``). A
*path* (``paths.py``) is what a phase leaves behind: a polynomial of each body, from which impacts are found.

This package knows no shapes and no rotations. What it needs of a dimension it asks by name (``operations.py``): a
kernel of the same name is provided by ``planar/`` and ``spatial/``, and chosen by the type of the first argument, which
is the dimension's own ``Bodies``. It imports neither of the two.

| operation | does |
|---|---|
| ``is_free(bodies, i)`` | whether forces move body i |
| ``hold(bodies, rows, lasting, c, k)`` | notes features of row c in body axes, so that `evaluate` can follow them |
| ``next_features(bodies, lasting, k)`` | lets contact k go on with other features that touch in its place |
| ``evaluate(bodies, lasting)`` | gap, frame, Jacobian, response, u and gamma of all noted contacts at any pose |
| ``free_accelerations(bodies, lasting)`` | `Lasting.free`: what loads and the gyroscopic term do |
| ``displace(bodies, lasting, i)`` | pose of i: `Lasting.base` moved by `Lasting.displacement` |
| ``displacement_rate(bodies, lasting, i, stage)`` | `Lasting.rate[stage]`: rate of the displacement at this twist |
| ``displacement_curvature(bodies, lasting, i, end)`` | `Lasting.bend[end]`: its second derivative |
| ``feature_limits(bodies, lasting, k, place)`` | how far the noted features still are from each of their ends [m] |
"""
