"""Reads a data lake with DuckDB and polars: rows, partitions, and that a query of one prototype leaves the others alone.

Argument: the lake, with two sessions of the prototype `mold 3/a` and one of `mold 4`. Files of the latter are overwritten.
"""

import sys
from pathlib import Path

import duckdb
import polars as pl

lake = Path(sys.argv[1])
ONE, OTHER = "mold 3/a", "mold 4"


def glob(table):
    return f"{lake}/{table}/**/*.parquet"


def duck(table, rest):
    source = f"read_parquet('{glob(table)}', hive_partitioning = true, hive_types = {{'prototype': VARCHAR, 'day': DATE}})"
    return duckdb.sql(f"SELECT {rest.replace('FROM', f'FROM {source}', 1)}").fetchall()


def polar(table):
    return pl.scan_parquet(glob(table), hive_partitioning=True)


# Ten presses a session, of which two are sync presses; the tables have the same keys.
for table in ["presses", "estimates", "features"]:
    assert duck(table, "prototype, count(*), count(DISTINCT session_id) FROM GROUP BY prototype ORDER BY prototype") == [
        (ONE, 20, 2),
        (OTHER, 10, 1),
    ], table
    counted = polar(table).group_by("prototype").len().sort("prototype").collect()
    assert counted.rows() == [(ONE, 20), (OTHER, 10)], counted
assert duck("poses", "count(DISTINCT session_id) FROM") == [(3,)]
assert polar("poses").select("session_id", "measured_z_mm", "bench", "day").head(5).collect().shape == (5, 4)

# The RMSE of the metrics follows from the presses and their estimates.
scored = (
    polar("presses")
    .filter((pl.col("role") == "score") & (pl.col("verdict") == "valid"))
    .join(polar("estimates"), on=["session_id", "press"])
    .group_by("session_id")
    .agg((pl.col("error_mm") ** 2).mean().sqrt().alias("rmse"))
)
metrics = polar("results").filter((pl.col("set") == "scored") & (pl.col("metric") == "rmse") & pl.col("depth_mm").is_null())
both = scored.join(metrics, on="session_id").collect()
assert both.height == 3
assert (both["rmse"] - both["value"]).abs().max() < 1e-9, both

# A query of one prototype does not touch the files of the other: they are no Parquet files any more.
for path in (lake / "estimates").rglob("*.parquet"):
    if "prototype=mold%204" in str(path):
        path.write_bytes(b"no Parquet")
query = f"avg(error_mm) FROM WHERE prototype = '{ONE}'"
(mean,) = duck("estimates", query)[0]
found = polar("estimates").filter(pl.col("prototype") == ONE).select(pl.col("error_mm").mean()).collect().item()
assert abs(mean - found) < 1e-9, (mean, found)
for read in [lambda: duck("estimates", "avg(error_mm) FROM"), lambda: polar("estimates").select("error_mm").collect()]:
    try:
        read()
    except (duckdb.Error, pl.exceptions.PolarsError):
        continue
    raise AssertionError("the overwritten files were read as Parquet")
