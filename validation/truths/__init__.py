"""Closed forms that several scenes share: columns, slides, rolls, boxes on an edge, leaning rods, corners."""
