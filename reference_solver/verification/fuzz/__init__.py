"""An attack that stays: random scenes, each certified, then run again in ways that must not change its answer.

`scenes` draws a world from a seed, `variants` are the other ways of running it, `trial` compares them. A certified run
that differs from a certified variant by more than both bounds X together is a defect, whoever of the two is wrong.
"""
