"""What tests of scenes ask of a record of their own, true or with a fault that they have planted."""


def failing(canonical, scene, trajectory):
    """Metrics of the judged checks that the record does not pass; what has no value does not pass."""
    measured = canonical.measure(scene, trajectory)
    return {
        check.metric
        for check in canonical.checks(scene, trajectory.dt)
        if check.bound is not None
        and (measured[check.metric][0] is None or not abs(measured[check.metric][0] - check.truth) <= check.bound)
    }
