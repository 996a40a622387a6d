"""Streams as sketches print them, made by hand from known frames: every kind of print that is read.

Nothing here uses the program's own encoders; a stream is bytes, and what is right of it is a list
of (distances, statuses) in the driver's order.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from app.sensing.wire.described import Print, Status

FRAMES = 4
ROWS = Print()
MIRRORED = Print(from_right=True)
BESIDE = Print(status=Status.BESIDE)
AFTER = Print(status=Status.AFTER)


class Stream(NamedTuple):
    """How it is read (a format's name or a description), its bytes, and what is right."""

    name: str
    how: str | Print
    data: bytes
    right: list


def truth(side, number, far=1200):
    """Distances [mm] of one frame, each zone its own, an object at the upper left."""
    grid = far + 7 * np.arange(side * side).reshape(side, side) + number
    grid[:2, :3] -= 900
    return grid


def codes(side, number):
    """Statuses: mostly 5, two merged, two without a target, one too weak."""
    out = np.full((side, side), 5)
    out[1, 1], out[0, 2], out[2, 3], out[3, 0], out[3, 3] = 9, 255, 255, 4, 9
    return out


def laid(how, grid):
    """As printed."""
    out = grid[:: -1 if how.from_bottom else 1, :: -1 if how.from_right else 1]
    return out.T if how.columns else out


def rows(how, side, show=str, sep="\t", before="", after=""):
    """Lines of one frame's rows, for every frame."""
    for number in range(FRAMES):
        yield (
            number,
            [
                before + sep.join(show(v) for v in row) + after
                for row in laid(how, truth(side, number)).tolist()
            ],
        )


def bare(side, missing=()):
    """What is right of frames without statuses."""
    out = []
    for number in range(FRAMES):
        mm = truth(side, number).ravel().copy()
        status = np.full(side * side, 5)
        for zone in missing:
            mm[zone], status[zone] = 0, 255
        out.append((mm, status))
    return out


def told(side, code=codes):
    return [(truth(side, n).ravel(), code(side, n).ravel()) for n in range(FRAMES)]


def joined(lines, end="\r\n"):
    return "".join(line + end for line in lines).encode()


def blocks(how, side, end="\r\n", head=(), tail=("",), **more):
    """Frames as blocks of rows, with what stands before and after each."""
    out = []
    for number, lines in rows(how, side, **more):
        out += [h.format(n=number, t=1000 + 66 * number) for h in head] + lines + list(tail)
    return joined(["boot", "", *out], end)


def line_ends(side):
    for name, end in {"lf": "\n", "cr lf": "\r\n", "lf cr": "\n\r", "cr cr lf": "\r\r\n"}.items():
        yield Stream(f"rows, {name}", "lines", blocks(MIRRORED, side, end), bare(side))
    yield Stream("rows, cr", ROWS, blocks(ROWS, side, "\r", head=("T",)), bare(side))


def decorated(side):
    """Bare rows with something around them."""
    kinds = {
        "tabs before": {"before": "\t"},
        "spaces after": {"sep": " ", "after": " "},
        "commas": {"sep": ","},
        "commas and spaces": {"sep": ", "},
        "semicolons": {"sep": "; "},
        "pipes": {"sep": " | ", "before": "| ", "after": " |"},
        "brackets": {"sep": ", ", "before": "[", "after": "]"},
        "json rows": {"sep": ", ", "before": "  [", "after": "],", "head": ('"mm": [',)},
        "braces": {"sep": ",", "before": "{", "after": "},"},
        "log of ESP-IDF": {"before": "I (12345) tof: ", "sep": " "},
        "log of ESPHome": {"before": "[12:04:31][D][tof:045]: ", "sep": " "},
        "time of the monitor": {"before": "12:04:31.123 -> ", "sep": " "},
        "tag": {"before": "[ToF] ", "sep": " "},
        "arrow": {"before": "> ", "sep": " "},
        "row's name": {"before": "row: ", "sep": " "},
        "colours": {"show": lambda v: f"\x1b[38;5;{v % 200}m{v:5d}\x1b[0m", "sep": " "},
        "background": {"show": lambda v: f"\x1b[48;2;1;2;3m {v:4d} \x1b[0m", "sep": ""},
        "home": {"head": ("\x1b[2J\x1b[H",), "tail": ()},
        "home and a blank": {"head": ("\x1b[2J\x1b[H",)},
        "heading": {"head": ("Distances",), "tail": ()},
        "heading with counter": {"head": ("Frame {n}:",), "tail": ()},
        "heading with time": {"head": ("t = {t} ms",), "tail": ()},
        "bare time": {"head": ("{t}",), "tail": ()},
        "unit": {"show": lambda v: f"{v} mm", "sep": ", "},
        "unit in the heading": {"head": ("Distance [mm]",), "tail": ()},
        "rules": {"head": ("-" * 40,), "tail": ("-" * 40,)},
        "stars": {"head": ("*" * 20,), "tail": ()},
        "corners": {"head": ("+----+----+",), "tail": ("+----+----+",), "before": "| ",
                    "sep": " | ", "after": " |"},
        "decimals": {"show": lambda v: f"{v}.00"},
        "padded": {"show": "{:6d}".format, "sep": ""},
    }  # fmt: skip
    for name, kind in kinds.items():
        yield Stream(name, ROWS, blocks(ROWS, side, **kind), bare(side))


def marks(side):
    """Zones 2 and n - 1, or others, hold a sign for nothing."""
    signs = ("x", "X", "xxxx", "-", "--", "----", ".", "*", "***", "nan", "NaN", "null", "inf",
             "0", "65535", "8190", "8191", "__", "n/a")  # fmt: skip
    for sign, sep in [*product(signs, (" ",)), ("-", ","), ("", ","), ("nan", ", "), ("x", "\t")]:
        missing = (2, side * side - 2) if not sign else (0, 2, side * side - 1)
        out = []
        for number in range(FRAMES):
            flat = [str(v) for v in truth(side, number).ravel()]
            for zone in missing:
                flat[zone] = sign
            out += [sep.join(flat[i : i + side]) for i in range(0, side * side, side)] + [""]
        data = joined(["boot", "", *out])
        yield Stream(f"mark {sign!r} by {sep!r}", ROWS, data, bare(side, missing))


def with_statuses(side):
    pairs = ("{}:{}", "{} : {}", "{} ({})", "{}({})", "{}/{}", "{}[{}]", "{} [{}]")
    for pair, sep in [*product(pairs, ("\t", ", ")), ("{:4d} : {:3d}", " | ")]:
        out = []
        for number in range(FRAMES):
            both = zip(truth(side, number).tolist(), codes(side, number).tolist(), strict=True)
            cells = [[pair.format(d, s) for d, s in zip(a, b, strict=True)] for a, b in both]
            out += [sep.join(row) for row in cells] + [""]
        yield Stream(f"pairs {pair} by {sep!r}", BESIDE, joined(["boot", "", *out]), told(side))
    for head in (("Distance", "Status"), ("[ToF] Distance", "[ToF] Status"), ("D:", "S:")):
        out = []
        for number in range(FRAMES):
            for name, grid in zip(head, (truth(side, number), codes(side, number)), strict=True):
                out += [name, *("  ".join(f"{v:4d}" for v in row) for row in grid.tolist())]
        data = joined(["boot", "", *out, "end"])
        yield Stream(f"second grid under {head[1]}", AFTER, data, told(side))
    out = []
    for number in range(FRAMES):
        for grid in (truth(side, number), codes(side, number)):
            out += [*(" ".join(map(str, row)) for row in grid.tolist()), ""]
    yield Stream("second grid, no names", AFTER, joined(["boot", "", *out]), told(side))
    yield from lines_with_statuses(side)


def lines_with_statuses(side):
    alternating, after, named, web = [], [], [], []
    turned = Print(columns=True, from_right=True, from_bottom=True)
    for number in range(FRAMES):
        d, s = truth(side, number).ravel().tolist(), codes(side, number).ravel().tolist()
        alternating.append(",".join(f"{a},{b}" for a, b in zip(d, s, strict=True)))
        after.append(",".join(map(str, [*d, *s])))
        named += ["D:" + ",".join(map(str, d)), "S:" + ",".join(map(str, s))]
        d, s = (laid(turned, g(side, number)).ravel().tolist() for g in (truth, codes))
        web += ["FRAME_START", f"RES:{side * side}", "RATE:15", "D:" + ",".join(map(str, d)),
                "S:" + ",".join(map(str, s)), "FRAME_END"]  # fmt: skip
    right = told(side)
    how = Print(status=Status.ALTERNATE)
    yield Stream("alternating line", how, joined(["boot", *alternating]), right)
    yield Stream("statuses after, one line", AFTER, joined(["boot", *after]), right)
    yield Stream("statuses after, next line", AFTER, joined(["boot", *named]), right)
    yield Stream("web serial", "adafruit-web", joined(["VL53L7CX WebSerial Demo", *web]), right)


def one_line(side):
    for before, sep in (("", ","), ("DATA:", ","), ("", " "), ("tof ", ";"), ("[", ", ")):
        out = [
            before + sep.join(map(str, truth(side, n).ravel().tolist())) + "]" * (before == "[")
            for n in range(FRAMES)
        ]
        yield Stream(f"one line {before!r} {sep!r}", ROWS, joined(["boot", *out]), bare(side))
    how = Print(skip=2)
    out = [
        f"{n},{1000 + 66 * n}," + ",".join(map(str, truth(side, n).ravel().tolist()))
        for n in range(FRAMES)
    ]
    yield Stream("counter and time first", how, joined(["boot", *out]), bare(side))
    nested = [str(truth(side, n).tolist()).replace(" ", "") for n in range(FRAMES)]
    flat = [str(truth(side, n).ravel().tolist()) for n in range(FRAMES)]
    for name, lists in (("nested", nested), ("flat", flat)):
        out = [f'{{"t":{n},"distances":{v}}}' for n, v in enumerate(lists)]
        yield Stream(f"json, {name}", "json", joined(["boot", *out]), bare(side))
    out = [f'{{"distance_mm":{v},"target_status":{codes(side, n).ravel().tolist()}}}'
           for n, v in enumerate(flat)]  # fmt: skip
    yield Stream("json with statuses", "json-status", joined(["boot", *out]), told(side))
    yield Stream("json, a bare list", "json", joined(["boot", *nested]), bare(side))


def zones(side):
    for end in ("\n", "\r\n"):
        out = []
        for number in range(FRAMES):
            both = zip(
                truth(side, number).ravel().tolist(),
                codes(side, number).ravel().tolist(),
                strict=True,
            )
            out.append(f"Print data no : {number:3d}")
            for z, (d, s) in enumerate(both):
                out.append(f"Zone : {z:3d}, Status : {s:3d}, Distance : {d:4d} mm")
            out.append("")
        yield Stream(f"a line a zone {end!r}", "uld", joined(["boot", *out], end), told(side))


def orders(side):
    for columns, right, bottom in product((False, True), repeat=3):
        how = Print(columns=columns, from_right=right, from_bottom=bottom)
        yield Stream(f"order {columns} {right} {bottom}", how, blocks(how, side), bare(side))
    turned = Print(columns=True, from_right=True, from_bottom=True)
    data = blocks(turned, side, before="\t")
    yield Stream("Adafruit's simple test", "adafruit", data, bare(side))
    data = blocks(ROWS, side, show=lambda v: f"{v / 10:.1f}", sep=" ")
    yield Stream("centimetres", Print(unit=10.0), data, bare(side))
    data = blocks(ROWS, side, show=lambda v: f"{v / 1000:.3f}", sep=" ")
    yield Stream("metres", Print(unit=1000.0), data, bare(side))
    head = "[12:04:31.250][D][text_sensor:119]: 'Zones': Sending state '"
    out = []
    for number in range(FRAMES):
        lines = [",".join(f"{v / 1000:.3f}" for v in row) for row in truth(side, number).tolist()]
        out += [head + lines[0] + ",", *(line + "," for line in lines[1:-1]), lines[-1] + ",'"]
        out += ["[12:04:31.260][D][sensor:100]: other"]
    yield Stream("ESPHome's text sensor", "esphome", joined(["boot", *out]), bare(side))


def tables(side):
    line = " -----------------" * side
    for name, zero in (("table", False), ("st-cube", True)):
        out = []
        for number in range(FRAMES):
            out += ["\x1b[2H53L8A1 Simple Ranging demo application", "-" * 38, "", "Cell Format :"]
            d, s = (g(side, number)[:, ::-1].tolist() for g in (truth, codes))
            for row, status in zip(d, s, strict=True):
                shown = [0 if zero and c in (5, 9) else c for c in status]
                cells = [
                    "|     X  :      X "
                    if c == 255
                    else f"| \x1b[38;5;10m{v:5d}\x1b[0m  :  {c:5d} "
                    for v, c in zip(row, shown, strict=True)
                ]
                out += [line, "|                 " * side + "|", "".join(cells) + "|"]
            out.append(line)
        right = told(side)
        if zero:
            right = [(d, np.where(s == 9, 5, s)) for d, s in right]
        yield Stream(f"the maker's table, {name}", name, joined(["boot", *out]), right)


def all_streams(side):
    """Every stream for sensors of side x side zones."""
    kinds = (line_ends, decorated, marks, with_statuses, one_line, zones, orders, tables)
    return [s for kind in kinds for s in kind(side)]
