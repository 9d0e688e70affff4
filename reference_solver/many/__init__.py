"""Many worlds stepped side by side (`reference_solver.Simulation.many`).

worlds     sorts models into groups and hands them to threads
groups     arrays of a group of planar worlds, and how long they stay together
planar     the textbook step of a group, a world in each lane (`reference_solver.lanes`)
contacts   contact points in all lanes at once
"""
