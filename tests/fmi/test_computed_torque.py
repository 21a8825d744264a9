"""examples/computed_torque.py as a reader runs it: the inverse FMU controls the plant FMU."""


def test_the_inverse_fmu_makes_the_plant_follow_its_trajectory(example, tmp_path):
    pd, computed = (line.split() for line in example("computed_torque.py", "kuka_kr5", "kuka_kr5_inverse"))
    # "...: largest error 0.0500 rad, after 1.5 s 1.6e-04 rad"
    assert float(computed[-7]) < 0.0501 and float(computed[-2]) < 1e-3
    assert float(pd[-7]) > 0.3 and float(pd[-2]) > 0.1
    assert (tmp_path / "out" / "computed_torque.png").stat().st_size > 10000
