"""`python -m twin robot|bench --effect NAME --seed N --out DIR`: write a case of logs."""

import argparse
import json

from .cases import BENCH_TESTS, ROBOT_MOTIONS, bench_case, robot_case
from .catalogue import CATALOGUE
from .measure import Sensors
from .scripts import from_table


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="twin", description=__doc__)
    parser.add_argument("kind", choices=["robot", "bench", "effects"])
    parser.add_argument("--effect", action="append", help="hidden effect; repeat for several")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--on", choices=["both", "front", "rear"], default="both")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--out", default="logs")
    parser.add_argument("--rate", type=float, default=1000.0)
    parser.add_argument("--noise", type=float, default=1.0, help="factor on all sensor noise")
    parser.add_argument("--floor", type=float, default=0.0, help="other effects, share of size")
    parser.add_argument("--gaps", type=float, default=0.0, help="share of missing cells")
    parser.add_argument("--chambers", choices=["first_order", "orifice"], default="first_order")
    parser.add_argument("--with", dest="extra", action="append", default=[],
                        choices=["velocities", "accelerometer", "force", "pressures", "feet"],
                        help="optional columns; repeat for several")  # fmt: skip
    parser.add_argument("--motion", action="append", help="robot motions or bench tests, in order")
    parser.add_argument("--table", action="append", help="controller CSV to execute (robot)")
    parser.add_argument("--show-truth", action="store_true")
    return parser


def main(argv: list[str] | None = None) -> int:
    args = arguments().parse_args(argv)
    if args.kind == "effects":
        for name, entry in CATALOGUE.items():
            sizes = ", ".join(
                f"{p} {s:g} {entry.unit[p]}" for p, (_, s) in entry.parameters.items()
            )
            print(f"{name:20s} {'' if entry.known else '(unknown) '}{sizes}")
        return 0
    sensors = Sensors(noise=args.noise, gaps=args.gaps, **dict.fromkeys(args.extra, True))
    options = {
        "size": args.size,
        "seed": args.seed,
        "runs": args.runs,
        "sensors": sensors,
        "rate": args.rate,
        "floor": args.floor,
        "chambers": args.chambers,
    }
    if args.kind == "robot":
        tables = [from_table(t) for t in args.table] if args.table else None
        motions = args.motion or ROBOT_MOTIONS
        paths, truth = robot_case(
            args.out, args.effect, on=args.on, motions=motions, scripts=tables, **options
        )
    else:
        tests = args.motion or BENCH_TESTS
        paths, truth = bench_case(args.out, args.effect, tests=tests, **options)
    for path in paths:
        print(path)
    if args.show_truth:
        print(json.dumps(truth["effects"]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
