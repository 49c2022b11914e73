"""Examples that `--help` shows below each command, to be typed as they are."""

from torquer.base.language import translated

_S = "examples/chibis_m_detumble.toml"

#: Command line by line, by the words of the command; "" for `torquer` itself.
EXAMPLES: dict[str, tuple[str, ...]] = {
    "": (
        "torquer init my_satellite",
        "torquer run my_satellite.toml",
        "torquer run --help",
    ),
    "board": (
        "torquer board my_satellite.toml",
        "torquer board examples/chibis_m_detumble.toml --port 0 --no-browser",
    ),
    "budget": (
        "torquer budget examples/disturbances.toml",
        "torquer budget examples/disturbances.toml --hold --out runs/budget",
        "torquer budget examples/pointing_budget.toml --pointing --flights 0",
    ),
    "campaign": (
        "torquer campaign examples/tip_off_campaign.toml --runs 200",
        "torquer campaign examples/tip_off_campaign.toml --member 17",
        "torquer campaign compare runs/a runs/b",
    ),
    "campaign join": ("torquer campaign join runs/part-1 runs/part-2 --out runs/whole",),
    "campaign compare": (
        "torquer campaign compare runs/a runs/b --out runs/a-and-b",
        "torquer campaign compare runs/a runs/b runs/c",
    ),
    "compare": (
        "torquer compare runs/gain_low runs/gain_high",
        "torquer compare runs/a/result.nc runs/b/result.nc runs/c/result.nc --out runs/three",
    ),
    "completion": (
        "torquer completion bash > ~/.local/share/bash-completion/completions/torquer",
        "torquer completion --install",
    ),
    "design": ("torquer design three-axis --help",),
    "design bench": (
        "torquer design bench --time-s 600 --bench-inertia 0.4 --inertia 1.6 --bench-field-nt 1e5 "
        "--field-nt 1e4",
    ),
    "design coil": (
        "torquer design coil --dipole-a-m2 3.2 --diameter-m 0.3 --mass-kg 0.4 --voltage-v 12",
        "torquer design coil --dipole-a-m2 3.2 --diameter-m 0.3 --mass-kg 0.4 --metal aluminium "
        "--json",
    ),
    "design detumble": (
        "torquer design detumble examples/chibis_m_detumble.toml --tip-off-deg-s 10 "
        "--out runs/gain",
        "torquer design detumble examples/chibis_m_detumble.toml --rate-below-deg-s 0.3 --json",
    ),
    "design magneto-gyro": (
        "torquer design magneto-gyro examples/magneto_gyro.toml --tip-off-deg-s 3 --out runs/gyro",
        "torquer design magneto-gyro examples/magneto_gyro.toml --form text --degree 0.3 --json",
    ),
    "design mission": (
        "torquer design mission examples/satellites/cubesat_3u.toml",
        "torquer design mission examples/satellites/cubesat_3u.toml --pointing-deg 10 --json",
    ),
    "design three-axis": (
        "torquer design three-axis --inertia 0.03 0.03 0.01 --altitude-km 550 "
        "--inclination-deg 97.6 --limit-a-m2 0.2",
        f"torquer design three-axis {_S}",
    ),
    "explain": ("torquer explain control.sample_s", "torquer explain spacecraft.coils"),
    "export": ("torquer export c examples/chibis_m_day.toml --out runs/adcs",),
    "export c": (
        "torquer export c examples/chibis_m_day.toml --out runs/adcs",
        "torquer export c examples/my_law.toml --out runs/mine --steps 5000",
        "torquer run examples/my_law.toml --computer runs/mine",
        "torquer export c examples/turn_to_the_sun.toml --real float --out runs/single",
        "torquer export c examples/chibis_m_detumble.toml --ephemeris sgp4 --out runs/known",
        "torquer export c examples/safe_mode.toml --prefix safe --out runs/safe",
    ),
    "faults": (
        "torquer faults examples/safe_mode.toml --out runs/faults",
        "torquer faults examples/safe_mode.toml --only gyro --at-h 10",
        "torquer faults examples/safe_mode.toml --pairs 100 --seed 3",
    ),
    "fly": (
        "torquer fly examples/chibis_m_day.toml --ticks 20000",
        "torquer fly examples/chibis_m_day.toml --commands examples/software/commands.toml "
        "--faults examples/software/faults.toml --out runs/faulty",
        "torquer fly examples/chibis_m_day.toml --realtime --ticks 60 --memory runs/memory",
        "torquer fly examples/chibis_m_day.toml --realtime --ticks 60 --listen tcp:127.0.0.1:7070",
    ),
    "field": (
        "torquer field point --lat 55.75 --lon 37.62 --date 2025-07-01",
        "torquer field orbit --scenario examples/chibis_m_detumble.toml",
    ),
    "field cone": ("torquer field cone --inclination-deg 51.6 --altitude-km 500",),
    "field map": ("torquer field map --element F --date 2025-01-01 --alt-km 500",),
    "field orbit": (
        "torquer field orbit --altitude-km 550 --inclination-deg 97.6 --start 2025-07-01 "
        "--model igrf14 --model tilted_dipole --out runs/field",
        "torquer field orbit --tle my_satellite.tle --revolutions 2 --json",
    ),
    "field point": (
        "torquer field point --lat 55.75 --lon 37.62 --alt-km 550 --date 2025-07-01",
        "torquer field point --points places.csv --date 2025-07-01 > field.csv",
        "torquer field point --lat 0 --lon 0 --date 2031.5 --extrapolate",
    ),
    "filter-check": (
        "torquer filter-check examples/which_sensors.toml --runs 100 --out runs/filter",
        "torquer filter-check examples/which_sensors.toml --attitude-sigma-deg 180",
        "torquer filter-check examples/which_sensors.toml --expected",
    ),
    "gallery": ("torquer gallery list", "torquer gallery run MAG-3.1.3"),
    "gallery all": ("torquer gallery all --out runs/gallery",),
    "gallery list": ("torquer gallery list --json",),
    "gallery run": ("torquer gallery run MAG-3.1.3 MAG-3.3.2",),
    "ground": (
        "torquer ground --link tcp:127.0.0.1:7070 --scenario examples/chibis_m_day.toml",
        "torquer ground examples/software/ground.toml --port 0 --no-browser",
    ),
    "ground at": (
        "torquer ground at 2012-01-25T12:00:00Z",
        "torquer ground at 2026-11-27T08:00:00Z --by received --json",
    ),
    "ground alarms": ("torquer ground alarms", "torquer ground alarms --log --json"),
    "ground export": (
        "torquer ground export runs/ground/satellite.sqlite --out runs/export",
        "torquer ground export runs/ground/satellite.sqlite --format csv --packet extended "
        "--start 2012-03-04T12:00:00Z",
    ),
    "ground gaps": (
        "torquer ground gaps --packet extended",
        "torquer ground gaps --packet extended --fill",
    ),
    "ground import": (
        "torquer ground import runs/chibis_m_day-flight/downlink.bin",
        "torquer ground import north.bin south.bin --satellite cubesat --software my_software.toml",
    ),
    "ground passes": (
        "torquer ground passes examples/software/ground.toml --out runs/passes",
        "torquer ground passes --elements cubesat.tle --station 54.73,37.18,180 --hours 48 "
        "--frequency 437.5e6",
        "torquer ground passes my_ground.toml --station tarusa --from 2026-03-01T00:00:00Z --json",
    ),
    "ground report": (
        "torquer ground report 3 --file my_ground.toml --from 2026-03-01T00:00:00Z --out pass.html",
        "torquer ground report --from 2012-03-04T10:31:00Z --to 2012-03-04T10:45:00Z",
    ),
    "ground send": (
        "torquer ground send report_status module_id=1",
        "torquer ground send set_mode region=stabilisation state=science",
        "torquer ground send coils_manual dipole=0.1,0,-0.2 duration=20 --delay-s 600",
    ),
    "ground plan": ("torquer ground plan", "torquer ground plan --json"),
    "ground cancel": ("torquer ground cancel 17",),
    "ground stack": (
        "torquer ground stack load examples/software/commissioning.toml --as Ada",
        "torquer ground stack next --as Ada",
        "torquer ground stack run",
        "torquer ground stack save examples/software/commissioning.toml",
    ),
    "ground history": (
        "torquer ground history --state refused",
        "torquer ground history --by Ada --start 2026-03-04T00:00:00Z --csv",
    ),
    "init": (
        "torquer init my_satellite",
        "torquer init my_satellite --like 3u --mass-kg 3.4 --panels 2",
        "torquer init my_satellite --like 150kg --wheels",
        "torquer init my_satellite --example wheels_in_flight",
        "torquer init --list",
    ),
    "kernels": ("torquer kernels build examples/chibis_m_detumble.toml --out kernels",),
    "kernels build": ("torquer kernels build examples/chibis_m_detumble.toml --out kernels",),
    "modes": (
        "torquer modes examples/sun_pointing.toml",
        "torquer modes examples/sun_pointing.toml --svg modes.svg",
    ),
    "run": (
        f"torquer run {_S}",
        f"torquer run {_S} --out runs/first --no-report --json",
        f"torquer run {_S} --out runs/first --resume --plots --page",
        f"torquer run {_S} --out runs/first --resume --figure paper",
    ),
    "smooth": ("torquer smooth runs/which_sensors", "torquer smooth runs/a/result.nc --json"),
    "table": (
        "torquer table runs/first --variables omega_body --variables rate --every-s 10 > first.csv",
        "torquer table runs/first --out first.parquet",
    ),
    "schema": ("torquer schema > scenario.schema.json",),
    "packets": (
        "torquer packets",
        "torquer packets examples/software/my_software.toml --out runs/packets",
    ),
    "packets import": ("torquer packets import mission.xml --out dictionary.toml",),
    "session": ("torquer session replay runs/chibis_m_day-flight/session.json",),
    "session bisect": ("torquer session bisect runs/a/session.json runs/b/session.json",),
    "session replay": ("torquer session replay runs/chibis_m_day-flight/session.json",),
    "telemetry": (
        "torquer telemetry pass.csv --mapping pass.mapping.toml --orbit my_satellite.tle",
        "torquer telemetry runs/a/result.nc --orbit examples/chibis_m_detumble.toml --model shift",
        "torquer telemetry pass.nc --orbit my_satellite.tle --filter examples/which_sensors.toml",
        "torquer telemetry tip-off.nc --orbit my_satellite.tle --twin my_satellite.toml",
    ),
    "telemetry init": (
        "torquer telemetry init pass.csv --out pass.mapping.toml",
        "torquer telemetry init pass.csv --orbit my_satellite.tle",
    ),
    "theory": (
        "torquer theory bdot --altitude-km 550 --inclination-deg 51.6 "
        "--inertia 1.0 1.2 1.5 --gain 1e6",
        f"torquer theory --scenario {_S} --design",
    ),
    "theory magneto-gyro": (
        "torquer theory magneto-gyro --order 12",
        "torquer theory magneto-gyro examples/magneto_gyro.toml --out runs/gyro-theory",
    ),
    "validate": (f"torquer validate {_S}", f"torquer validate {_S} --json"),
    "version": ("torquer version", "torquer version --json"),
    "wheels": (
        "torquer wheels examples/wheels/foton.toml",
        "torquer wheels examples/wheels/foton.toml --out runs/wheels",
        "torquer wheels examples/wheels/foton.toml --sweep alpha_deg=40:88 --out runs/wheels",
    ),
}


def show_examples(words: str) -> str:
    """The examples below the help of a command: the format is Markdown, a line each."""
    return "\n".join([translated("Examples:"), "", *(f"    {line}" for line in EXAMPLES[words])])
