"""Free fall of the KUKA KR5 for one second, with damping in its second joint. Run `make demo` first."""

from pathlib import Path

if not Path("out/kuka_kr5.fmu").exists():
    raise SystemExit("out/kuka_kr5.fmu not found: run `make demo`")

from fmpy import simulate_fmu

result = simulate_fmu(
    "out/kuka_kr5.fmu",
    stop_time=1,
    start_values={"joint2.q0": 0.5, "joint2.damping": 20},  # rad, N m s/rad
    output=["joint2.q", "energy.balance"],
)
for time, angle, balance in result[::10]:
    print(f"{time:.1f} s   joint2 {angle:7.4f} rad   energy balance {balance:8.1e} J")
