"""What is asked of an engine beyond single cells: order, limits, symmetries, nulls, parameters, what checks can see."""
