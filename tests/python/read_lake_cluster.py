"""Reads a data lake with Dask and Spark: rows, partitions, and that a query of one prototype leaves the files of the others alone.

Argument: the lake, with two sessions of the prototype `mold 3/a` and one of `mold 4`. Spark is left out without Java and the package `pyspark`.
"""

import importlib.util
import shutil
import sys
import tempfile
from pathlib import Path

import dask.dataframe as dd

lake = sys.argv[1]
ONE, OTHER = "mold 3/a", "mold 4"
EXPECTED = {ONE: 20, OTHER: 10}

presses = dd.read_parquet(f"{lake}/presses", dataset={"partitioning": "hive"})
counted = presses.groupby("prototype", observed=True).size().compute().to_dict()
assert counted == EXPECTED, counted
one = dd.read_parquet(f"{lake}/presses", dataset={"partitioning": "hive"}, filters=[("prototype", "==", ONE)])
assert one.npartitions < presses.npartitions, (one.npartitions, presses.npartitions)
assert len(one) == 20

if shutil.which("java") is None or importlib.util.find_spec("pyspark") is None:
    print("skipped: Spark needs Java and the package pyspark")
    sys.exit(0)

from pyspark.sql import SparkSession  # noqa: E402

spark = SparkSession.builder.master("local[1]").config("spark.ui.enabled", "false").getOrCreate()
read = spark.read.option("mergeSchema", "true").parquet
for table in ["presses", "estimates", "features"]:
    rows = read(f"{lake}/{table}").groupBy("prototype").count().collect()
    assert {row["prototype"]: row["count"] for row in rows} == EXPECTED, (table, rows)
read(f"{lake}/presses").createOrReplaceTempView("presses")
read(f"{lake}/estimates").createOrReplaceTempView("estimates")
read(f"{lake}/results").createOrReplaceTempView("results")
differences = spark.sql("""
    SELECT max(abs(own.rmse - r.value)) AS difference, count(*) AS sessions FROM (
        SELECT p.session_id, sqrt(avg(e.error_mm * e.error_mm)) AS rmse
        FROM presses p JOIN estimates e ON e.session_id = p.session_id AND e.press = p.press
        WHERE p.role = 'score' AND p.verdict = 'valid' GROUP BY p.session_id) own
    JOIN results r ON r.session_id = own.session_id
    WHERE r.`set` = 'scored' AND r.metric = 'rmse' AND r.depth_mm IS NULL
""").collect()[0]
assert differences["sessions"] == 3 and differences["difference"] < 1e-9, differences

# The files of the other prototype are no Parquet files any more: a query of one does not read them.
with tempfile.TemporaryDirectory() as folder:
    copy = Path(folder) / "estimates"
    shutil.copytree(f"{lake}/estimates", copy)
    for path in copy.rglob("*.parquet"):
        if "prototype=mold%204" in str(path):
            path.write_bytes(b"no Parquet")
    estimates = spark.read.parquet(str(copy))
    assert estimates.where(f"prototype = '{ONE}'").count() == EXPECTED[ONE]
    try:
        estimates.select("error_mm").collect()
    except Exception as error:
        assert "Parquet" in str(error), error
    else:
        raise AssertionError("the overwritten files were read as Parquet")
print(f"Spark {spark.version}: {differences['sessions']} sessions")
spark.stop()
