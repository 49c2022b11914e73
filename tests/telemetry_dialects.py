"""The same rows of a magnetometer in many dialects of files: text, mapping, what init must find."""

import bz2
import gzip
import io
import json
import lzma
import zipfile
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import NamedTuple

import numpy as np

START = datetime(2012, 3, 4, 10, 32, 23, tzinfo=UTC)
ROWS, STEP_S, DAY_S = 24, 36, 86400.0
#: TAI - UTC at that time [s], and the first instants of some counts.
TAI_MINUS_UTC_S = 34
NT = {"b_measured": "nT"}
XYZ = ["mag_x", "mag_y", "mag_z"]
B_NT = np.round(
    25000.0 * np.stack([np.sin(0.9 * np.arange(ROWS)), np.cos(0.9 * np.arange(ROWS)),
                        np.cos(0.37 * np.arange(ROWS))], axis=1) + [1500.0, -900.0, 2200.0], 1
)  # fmt: skip
STAMPS = [START + timedelta(seconds=STEP_S * k) for k in range(ROWS)]


class Dialect(NamedTuple):
    """A file, the mapping that reads it; `init`: whether a mapping is found without an orbit."""

    name: str
    content: str | bytes
    mapping: dict
    init: bool = True
    file: str = "file.csv"
    rows: int = ROWS


def iso(stamp, sep="T", end="Z"):
    return stamp.strftime(f"%Y-%m-%d{sep}%H:%M:%S") + end


def grid(sep=",", head=("time", *XYZ), stamp=iso, number="{:.1f}".format, ends="\n", between="\n"):
    """Lines of a table."""
    lines = [sep.join(head)] if head else []
    for moment, row in zip(STAMPS, B_NT, strict=True):
        lines.append(sep.join([stamp(moment), *map(number, row)]))
    return between.join(lines) + ends


def mapping(columns=XYZ, time="time", unit="nT", **keys):
    return {"time": time, "columns": {"b_measured": columns}, "units": {"b_measured": unit}} | keys


def comma(x):
    return f"{x:.1f}".replace(".", ",")


def german(x):
    return f"{x:,.1f}".replace(",", " ").replace(".", ",").replace(" ", ".")


def clock(form, hours=0):
    return lambda stamp: (stamp + timedelta(hours=hours)).strftime(form)


def counted(start, tick_s=1.0, leap_s=0.0, form="{:.3f}"):
    """Counts from an instant of a calendar, `leap_s` more than it says."""

    def text(stamp):
        return form.format(((stamp - start).total_seconds() + leap_s) / tick_s)

    return text  # fmt: skip


def at(*date):
    return datetime(*date, tzinfo=UTC)


def records(**more):
    return [
        {"time": iso(moment), "mag": dict(zip("xyz", row.tolist(), strict=True))} | more
        for moment, row in zip(STAMPS, B_NT, strict=True)
    ]


LONG_HEAD = "time,parameter,value"


def long_rows(names=XYZ, head=LONG_HEAD, more=""):
    lines = [head]
    for moment, row in zip(STAMPS, B_NT, strict=True):
        lines += [f"{iso(moment)},{n},{x:.1f}{more}" for n, x in zip(names, row, strict=True)]
    return "\n".join(lines) + "\n"


def influx_csv():
    lines = ["#group,false,false,true,false,false,true",
             "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,double,string",
             "#default,_result,,,,,"]  # fmt: skip
    for k, name in enumerate(XYZ):
        lines += ["", ",result,table,_start,_time,_value,_field"] if k else [
            ",result,table,_start,_time,_value,_field"]  # fmt: skip
        lines += [
            f",,{k},2012-03-04T00:00:00Z,{iso(moment)},{row[k]:.1f},{name}"
            for moment, row in zip(STAMPS, B_NT, strict=True)
        ]
    return "\n".join(lines) + "\n"


def zipped(text, *more):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in (("a/pass.csv", text), *more):
            archive.writestr(name, content)
    return out.getvalue()


def arrays(pattern, sep=",", head="time;mag"):
    lines = [head]
    for moment, row in zip(STAMPS, B_NT, strict=True):
        lines.append(f"{iso(moment)};{pattern.format(sep.join(f'{x:.1f}' for x in row))}")
    return "\n".join(lines)


PLAIN = grid()
SPACE = mapping(zone="UTC")
UNZONED = clock("%Y-%m-%d %H:%M:%S")
HEADLESS = grid(head=())
GPS_S = counted(at(1980, 1, 6), leap_s=TAI_MINUS_UTC_S - 19)


def days(first, start):
    """Numbers of days, of which `first` is the one of an instant."""
    return lambda stamp: f"{first + (stamp - start).total_seconds() / DAY_S:.12f}"


def gps_week(stamp, modulo=10**6):
    """Week of GPS and seconds in it, the week as receivers of ten bits count."""
    week, second = divmod(float(GPS_S(stamp)), 604800.0)
    return f"{int(week) % modulo:d},{second:.3f}"


def time_keys(form, head="t", **more):
    return mapping(time=head, time_format=form, **more)


def a_count(form, start, tick_s=1.0, leap_s=0.0, text="{:.6f}", init=False, head="t", **more):
    content = grid(head=(head, *XYZ), stamp=counted(start, tick_s, leap_s, text))
    return Dialect(f"count {form}", content, time_keys(form, head, **more), init)


DIALECTS = [
    Dialect("plain", PLAIN, mapping()),
    Dialect("blank stamps without zone", grid(stamp=UNZONED), SPACE),
    Dialect("semicolon and decimal comma", grid(";", number=comma), mapping()),
    Dialect("decimal comma stated", grid(";", number=comma), mapping(decimal=",")),
    Dialect("thousands by points", grid(";", number=german), mapping()),
    Dialect("thousands by blanks", grid(";", number=lambda x: f"{x:,.1f}".replace(",", " ")),
            mapping()),
    Dialect("tabs", grid("\t"), mapping()),
    Dialect("bars", grid("|"), mapping()),
    Dialect("bars with blanks", grid(" | "), mapping()),
    Dialect("white space", grid("   "), mapping()),
    Dialect("date and time by white space",
            grid(" ", head=("date", "clock", *XYZ), stamp=UNZONED),
            mapping(time=["date", "clock"], zone="UTC")),
    Dialect("two texts between", grid("::"), mapping(separator="::"), init=False),
    Dialect("BOM", ("\ufeff" + PLAIN).encode(), mapping()),
    Dialect("UTF-16", PLAIN.encode("utf-16"), mapping()),
    Dialect("UTF-16 without a mark", PLAIN.encode("utf-16-le"), mapping()),
    Dialect("UTF-32", PLAIN.encode("utf-32"), mapping()),
    Dialect("Latin-1", grid(head=("time", "x [nT] \u00e9", "y", "z")).encode("latin-1"),
            mapping(["x [nT] \u00e9", "y", "z"], encoding="latin-1"), init=False),
    Dialect("Windows Cyrillic",
            grid(head=("\u0432\u0440\u0435\u043c\u044f", *XYZ)).encode("cp1251"),
            mapping(time="\u0432\u0440\u0435\u043c\u044f", encoding="cp1251")),
    Dialect("CRLF", PLAIN.replace("\n", "\r\n").encode(), mapping()),
    Dialect("CR", PLAIN.replace("\n", "\r").encode(), mapping()),
    Dialect("empty lines", "\n\n" + grid(between="\n\n", ends="\n\n\n"), mapping()),
    Dialect("separators at the ends", PLAIN.replace("\n", ",\n"), mapping()),
    Dialect("separators at the rows' ends", PLAIN.replace("\n", ",\n").replace(",\n", "\n", 1),
            mapping()),
    Dialect("notes above the head", "Satellite A\nPass 12\n\n" + PLAIN, mapping()),
    Dialect("head in a comment", "# a note\n# " + PLAIN, mapping()),
    Dialect("comments between",
            PLAIN.replace("\n2012-03-04T10:35", "\n# eclipse\n2012-03-04T10:35"),
            mapping()),
    Dialect("other comments", "% note\n% " + PLAIN, mapping(comment="%"), init=False),
    Dialect("row of units", PLAIN.replace("\n", "\nUTC,nT,nT,nT\n", 1), mapping()),
    Dialect("row of units in brackets", PLAIN.replace("\n", "\n[-],[nT],[nT],[nT]\n", 1),
            mapping()),
    Dialect("a line of dashes and a sum", PLAIN.replace("\n", "\n-----+----\n", 1) + "(24 rows)\n",
            mapping(skip_lines=["---", "("]), init=False),
    Dialect("a table of psql", grid(" | ").replace("\n", "\n-----+-----\n", 1) + "(24 rows)\n",
            mapping()),
    Dialect("a table of Markdown",
            "\n".join(f"| {line} |" for line in
                      grid(" | ").replace("\n", "\n---|---|---|---\n", 1).strip().split("\n")),
            mapping()),
    Dialect("a commented row of units",
            "# time mag_x mag_y mag_z\n# UTC nT nT nT\n" + grid(" ", head=()), mapping()),
    Dialect("fractions of some seconds",
            grid(stamp=lambda m: m.strftime("%d.%m.%Y %H:%M:%S") + ".000" * (m.second % 2)),
            mapping(time_format="%d.%m.%Y %H:%M:%S", zone="UTC")),
    Dialect("the date last", grid(stamp=clock("%H:%M:%S %d-%m-%Y")),
            mapping(time_format="%H:%M:%S %d-%m-%Y", zone="UTC")),
    Dialect("UTC after another format", grid(stamp=clock("%d.%m.%Y %H:%M:%S UTC")),
            mapping(time_format="%d.%m.%Y %H:%M:%S")),
    Dialect("a format that ends with Z", grid(stamp=clock("%d.%m.%Y %H:%M:%SZ")),
            mapping(time_format="%d.%m.%Y %H:%M:%SZ", zone="UTC")),
    Dialect("zeros between", PLAIN.replace("\n", "\0\n").encode(), mapping(encoding="utf-8"),
            init=False),
    Dialect("lines by number", PLAIN.replace("\n", "\nbegin,of,it,\n", 1),
            mapping(skip_lines=[2]), init=False),
    Dialect("sep=", "sep=;\n" + grid(";"), mapping()),
    Dialect("quotes", PLAIN.replace(",", '","').replace("\n", '"\n"')[:-1].join(['"', ""]),
            mapping()),
    Dialect("no head", HEADLESS, mapping(names=["time", *XYZ]), init=False),
    Dialect("exports joined", PLAIN[: len(PLAIN.split("2012-03-04T10:40")[0])]
            + PLAIN.split("\n")[0] + "\n"
            + "2012-03-04T10:40" + PLAIN.split("2012-03-04T10:40", 1)[1], mapping()),
    Dialect("exports joined in another order",
            "\n".join(PLAIN.split("\n")[:13]) + "\nmag_z,mag_y,mag_x,time\n"
            + "\n".join(",".join(each.split(",")[::-1]) for each in PLAIN.split("\n")[13:]),
            mapping()),
    Dialect("units in the cells", grid(";", number="{:.1f} nT".format), mapping()),
    Dialect("units in the cells, not those of the mapping",
            grid(";", number=lambda x: f"{x / 1e3:.4f} \u00b5T"), mapping()),
    Dialect("units that change", grid(";", number=lambda x: f"{x:.1f} nT" if abs(x) < 9e3 else
                                      f"{x / 1e3:.4f} \u00b5T"), mapping()),
    Dialect("Grafana", grid(number=lambda x: f'"{x:,.1f} nT"'), mapping()),
    Dialect("minus signs of typesetters", grid(number=lambda x: f"{x:.1f}".replace("-", "\u2212")),
            mapping()),
    Dialect("exponents", grid(number="{:.6e}".format), mapping()),
    Dialect("a list in a cell", arrays("[{}]", ", "), mapping("mag")),
    Dialect("numbers in a cell by blanks", arrays("{}", " "), mapping("mag")),
    Dialect("numbers in a cell by backslashes", arrays("{}", "\\"),
            mapping("mag", split={"b_measured": "\\"})),
    Dialect("microtesla", grid(head=("time", "bx_uT", "by_uT", "bz_uT"),
                               number=lambda x: f"{x / 1e3:.4f}"),
            mapping(["bx_uT", "by_uT", "bz_uT"], unit="uT")),
    Dialect("counts", grid(number=lambda x: f"{round((x + 1e5) * 10.0):d}"),
            mapping(scale={"b_measured": 0.1}, offset={"b_measured": -1e5}), init=False),
    Dialect("counts of each axis", grid(number=lambda x: f"{round(x * 10.0):d}"),
            mapping(scale={"b_measured": [0.1, 0.1, 0.1]}), init=False),
    Dialect("axes in another order",
            grid(head=("time", "sx", "sy", "sz")).replace("sx", "s1"),
            mapping(["sy", "sz", "s1"], order={"b_measured": ["y", "z", "x"]}), init=False),
    Dialect("a row for each number", long_rows(),
            mapping(long={"name": "parameter", "value": "value"})),
    Dialect("a row for each number, with paths", long_rows([f"/SAT/A/{n}" for n in XYZ]),
            mapping([f"/SAT/A/{n}" for n in XYZ], long={"name": "parameter", "value": "value"})),
    Dialect("a row for each number, with units", long_rows(more=",nT", head=LONG_HEAD + ",unit"),
            mapping(unit="uT", long={"name": "parameter", "value": "value", "unit": "unit"})),
    Dialect("a row for each number, with units of another name",
            long_rows(more=",nT,good", head=LONG_HEAD + ",UoM,quality"),
            mapping(long={"name": "parameter", "value": "value", "unit": "UoM"})),
    Dialect("InfluxDB CSV", influx_csv(), mapping(time="_time")),
    Dialect("InfluxDB line protocol", "\n".join(
        f"mag,sat=a mag_x={r[0]:.1f},mag_y={r[1]:.1f},mag_z={r[2]:.1f} {1e9 * m.timestamp():.0f}"
        for m, r in zip(STAMPS, B_NT, strict=True)), mapping(time_format="unix_ns")),
    Dialect("InfluxDB JSON", json.dumps({"results": [{"series": [{
        "name": "mag", "columns": ["time", *XYZ],
        "values": [[iso(m), *r.tolist()] for m, r in zip(STAMPS, B_NT, strict=True)]}]}]}),
        mapping()),
    Dialect("JSON lines", "\n".join(map(json.dumps, records())),
            mapping(["mag.x", "mag.y", "mag.z"]),
            file="a.jsonl"),
    Dialect("JSON list", json.dumps(records()), mapping(["mag.x", "mag.y", "mag.z"])),
    Dialect("JSON columns", json.dumps({"time": [iso(m) for m in STAMPS],
                                        **dict(zip(XYZ, B_NT.T.tolist(), strict=True))}),
            mapping()),
    Dialect("JSON with lists", "\n".join(
        json.dumps({"time": iso(m), "mag": r.tolist()}) for m, r in zip(STAMPS, B_NT, strict=True)),
        mapping("mag")),
    Dialect("gzip", gzip.compress(PLAIN.encode()), mapping(), file="a.csv.gz"),
    Dialect("bzip2", bz2.compress(PLAIN.encode()), mapping()),
    Dialect("xz", lzma.compress(PLAIN.encode()), mapping()),
    Dialect("ZIP", zipped(PLAIN), mapping(), file="a.zip"),
    Dialect("ZIP of several", zipped(PLAIN, ("notes.txt", "x")), mapping(member="a/pass.csv"),
            init=False),
    Dialect("only some rows",
            "\n".join(f"{line},{'sat' if k == 0 else 'A'}" + (f"\n{line},B" if k else "")
                      for k, line in enumerate(PLAIN.strip().split("\n"))),
            mapping(only={"sat": "A"}), init=False),
    Dialect("missing as a number", PLAIN + "2012-03-04T10:50:00Z,-9999,-9999.0,-9999\n",
            mapping(missing=["", "-9999"]), init=False, rows=ROWS + 1),
    Dialect("day before month", grid(stamp=clock("%d/%m/%Y %H:%M:%S")),
            mapping(time_format="%d/%m/%Y %H:%M:%S", zone="UTC")),
    Dialect("month before day", grid(stamp=clock("%m/%d/%Y %I:%M:%S %p")),
            mapping(time_format="%m/%d/%Y %I:%M:%S %p", zone="UTC"), init=False),
    Dialect("names of months", grid(stamp=clock("%d-%b-%Y %H:%M:%S")),
            mapping(time_format="%d-%b-%Y %H:%M:%S", zone="UTC")),
    Dialect("day of the year, ISO", grid(stamp=clock("%Y-%jT%H:%M:%SZ")), mapping()),
    Dialect("day of the year, a format", grid(stamp=clock("%Y/%j %H:%M:%S")),
            mapping(time_format="%Y/%j %H:%M:%S", zone="UTC")),
    Dialect("compact ISO", grid(stamp=clock("%Y%m%dT%H%M%SZ")), mapping()),
    Dialect("ISO with a comma", grid(";", stamp=clock("%Y-%m-%dT%H:%M:%S,000Z")), mapping()),
    Dialect("an offset", grid(stamp=clock("%Y-%m-%dT%H:%M:%S+04:00", 4)), mapping()),
    Dialect("an offset after a blank", grid(stamp=clock("%Y-%m-%d %H:%M:%S +0400", 4)), mapping()),
    Dialect("UTC after a blank", grid(stamp=clock("%Y-%m-%d %H:%M:%S UTC")), mapping()),
    Dialect("an abbreviation", grid(stamp=clock("%Y-%m-%d %H:%M:%S MSK", 4)),
            mapping(zone="Europe/Moscow")),
    Dialect("RFC 2822", grid(";", stamp=format_datetime), mapping()),
    Dialect("a zone by name", grid(stamp=clock("%Y-%m-%d %H:%M:%S", 4)),
            mapping(zone="Europe/Moscow"), init=False),
    Dialect("date and time in two columns",
            grid(head=("Date", "Time", *XYZ), stamp=clock("%d.%m.%Y,%H:%M:%S")),
            mapping(time=["Date", "Time"], time_format="%d.%m.%Y %H:%M:%S", zone="UTC")),
    Dialect("digits alone", grid(stamp=clock("%Y%m%d%H%M%S")),
            mapping(time_format="%Y%m%d%H%M%S", zone="UTC")),
    a_count("unix_s", at(1970, 1, 1), init=True, head="unix_time"),
    a_count("unix_ms", at(1970, 1, 1), 1e-3, text="{:.0f}", init=True, head="time"),
    a_count("unix_ns", at(1970, 1, 1), 1e-9, text="{:.0f}", init=True, head="time"),
    a_count("unix_days", at(1970, 1, 1), DAY_S, text="{:.12f}"),
    a_count("gps_s", at(1980, 1, 6), leap_s=TAI_MINUS_UTC_S - 19, init=True, head="gps_time"),
    a_count("gps_ms", at(1980, 1, 6), 1e-3, TAI_MINUS_UTC_S - 19, init=True, head="gps_ms"),
    a_count("galileo_s", at(1999, 8, 22), leap_s=TAI_MINUS_UTC_S - 19),
    a_count("beidou_s", at(2006, 1, 1), leap_s=1),
    a_count("tai_1958_s", at(1958, 1, 1), leap_s=TAI_MINUS_UTC_S, init=True, head="cuc_time"),
    a_count("tai_1970_s", at(1970, 1, 1), leap_s=TAI_MINUS_UTC_S),
    a_count("tai_2000_s", at(2000, 1, 1), leap_s=TAI_MINUS_UTC_S, init=True, head="time_tai"),
    a_count("j2000_s", at(2000, 1, 1, 12), leap_s=TAI_MINUS_UTC_S + 32.184, init=True,
            head="t_j2000"),
    a_count("utc_2000_s", at(2000, 1, 1)),
    a_count("1904_s", at(1904, 1, 1), init=True, head="labview time"),
    a_count("1900_s", at(1900, 1, 1), init=True, head="ntp_time"),
    a_count("1601_us", at(1601, 1, 1), 1e-6, text="{:.0f}"),
    a_count("since_s", at(2012, 3, 4), epoch="2012-03-04T00:00:00Z"),
    a_count("elapsed_s", at(2011, 3, 4), epoch="2011-03-04T00:00:00Z"),
    Dialect("count julian", grid(head=("jd", *XYZ), stamp=days(2451545.0, at(2000, 1, 1, 12))),
            time_keys("julian", "jd")),
    a_count("mjd", at(1858, 11, 17), DAY_S, text="{:.12f}", init=True, head="mjd"),
    a_count("mjd2000", at(2000, 1, 1), DAY_S, text="{:.12f}", init=True, head="mjd2000"),
    a_count("excel", at(1899, 12, 30), DAY_S, text="{:.12f}", init=True, head="time", zone="UTC"),
    a_count("excel_1904", at(1904, 1, 1), DAY_S, text="{:.12f}", zone="UTC"),
    Dialect("count datenum", grid(head=("datenum", *XYZ), stamp=days(719529.0, at(1970, 1, 1))),
            time_keys("datenum", "datenum", zone="UTC")),
    Dialect("GPS week and seconds", grid(head=("week", "tow", *XYZ), stamp=gps_week),
            mapping(time=["week", "tow"], time_format=["gps_weeks", "s"])),
    Dialect("GPS week of ten bits",
            grid(head=("week", "tow", *XYZ), stamp=lambda m: gps_week(m, 1024)),
            mapping(time=["week", "tow"], time_format=["gps_weeks", "s"],
                    epoch="1999-08-21T23:59:47Z"), init=False),
    Dialect("year and day of the year",
            grid(head=("year", "doy", *XYZ),
                 stamp=lambda m: f"2012,{days(1.0, at(2012, 1, 1))(m)}"),
            mapping(time=["year", "doy"], time_format=["year", "day_of_year"], zone="UTC")),
    Dialect("year, day and seconds",
            grid(head=("year", "doy", "sod", *XYZ),
                 stamp=lambda m: f"2012,64,{(m - at(2012, 3, 4)).total_seconds():.3f}"),
            mapping(time=["year", "doy", "sod"], time_format=["year", "day_of_year", "s"],
                    zone="UTC")),
    Dialect("year and day in one number",
            grid(head=("yyyyddd", *XYZ), stamp=days(2012001.0, at(2012, 1, 1))),
            mapping(time="yyyyddd", time_format="year_day", zone="UTC"), init=False),
    Dialect("seconds and nanoseconds", grid(head=("sec", "nsec", *XYZ),
                                            stamp=lambda m: f"{int(m.timestamp())},0"),
            mapping(time=["sec", "nsec"], time_format=["unix_s", "ns"]), init=False),
]  # fmt: skip
