"""Motions with truths of their own (E76): every certified answer must be as near to them as its X says.

Numbers of each motion are drawn from a seed. Truths are closed forms, or differential equations of the few coordinates
that are left, integrated by the classical Runge-Kutta method; none of them knows a contact problem of the solver.
`planar` and `spatial` state them, `gates` measures.
"""
