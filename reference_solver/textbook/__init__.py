"""What the time steps of both dimensions share (`textbook2`, `textbook3`): it knows no shapes and no rotations."""
