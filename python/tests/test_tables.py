"""Tables come in and go out by Arrow, whoever made them."""

import numpy as np
import pytest

import penetrode as pn

pa = pytest.importorskip("pyarrow")

COUNT = 40_000
COLUMNS = {
    "mass_kg": np.full(COUNT, 2.0),
    "diameter_m": np.full(COUNT, 0.05),
    "nose_factor": np.full(COUNT, 0.72),
    "strength_pa": np.full(COUNT, 36e6),
    "density_kg_m3": np.full(COUNT, 2300.0),
    "velocity_m_s": np.linspace(1.0, 900.0, COUNT),
}
DEPTHS = pn.batch(COLUMNS)["depth_m"]


def test_pyarrow():
    table = pa.table(COLUMNS)
    found = pn.batch(table)
    assert np.array_equal(found["depth_m"], DEPTHS)
    out = pa.table(found)
    assert out.num_rows == COUNT and out.column_names == found.columns
    assert np.array_equal(out["depth_m"].to_numpy(), DEPTHS)
    chunked = pa.concat_tables([table.slice(0, 3), table.slice(3, 30_000), table.slice(30_003)])
    assert np.array_equal(pn.batch(chunked)["depth_m"], DEPTHS)
    assert pn.batch(chunked)["row"].tolist() == list(range(1, COUNT + 1))


def test_pandas_and_back():
    pd = pytest.importorskip("pandas")
    found = pn.batch(pd.DataFrame(COLUMNS))
    assert np.array_equal(found["depth_m"], DEPTHS)
    assert np.array_equal(found.to_pandas()["depth_m"], DEPTHS)


def test_polars_and_back():
    pl = pytest.importorskip("polars")
    found = pn.batch(pl.DataFrame(COLUMNS).with_columns(criterion=pl.lit("full-depth").cast(pl.Categorical)))
    assert np.array_equal(found["depth_m"], DEPTHS)
    assert np.array_equal(found.to_polars()["depth_m"].to_numpy(), DEPTHS)


def test_duckdb():
    duckdb = pytest.importorskip("duckdb")
    scenes = pa.table(COLUMNS)  # noqa: F841 (DuckDB finds it by its name)
    found = pn.batch(duckdb.sql("select * from scenes where velocity_m_s < 100"))
    assert np.array_equal(found["depth_m"], DEPTHS[: len(found)])


def test_the_older_protocol_of_tables():
    class Older:
        def __init__(self, table):
            self.table = table

        def __dataframe__(self, *words, **options):
            return self.table.__dataframe__(*words, **options)

    assert np.array_equal(pn.batch(Older(pa.table(COLUMNS)))["depth_m"], DEPTHS)


def test_every_kind_of_number_and_an_empty_cell():
    small = {name: column[:4] for name, column in COLUMNS.items()}
    small["velocity_m_s"] = np.array([100, 200, 300, 400])
    expected = pn.batch(small)["depth_m"]
    for kind in (np.int16, np.uint16, np.int32, np.uint64, np.float32):
        whole = {**small, "velocity_m_s": small["velocity_m_s"].astype(kind)}
        assert np.array_equal(pn.batch(whole)["depth_m"], expected), kind
        assert np.array_equal(pn.batch(pa.table(whole))["depth_m"], expected), kind
    table = pa.table(small).append_column("thickness_m", pa.array([None, 0.05, None, None], pa.float64()))
    found = pn.batch(table.append_column("S", pa.nulls(4)))
    assert found["outcome"].tolist() == ["stopped-in-crater", "perforated", *found["outcome"][2:]]
    missing = pn.batch(table.set_column(0, "mass_kg", pa.array([2.0, None, 2.0, 2.0])))
    assert missing.bad == 1 and "row 2" in missing["error"][1] and missing["error"][0] is None


def test_rows_do_not_depend_on_threads_or_neighbours():
    for threads in (1, 2, 8):
        assert np.array_equal(pn.batch(COLUMNS, threads=threads)["depth_m"], DEPTHS)
    assert pn.batch({name: column[777:778] for name, column in COLUMNS.items()})["depth_m"][0] == DEPTHS[777]


def test_other_columns_go_with_their_rows():
    few = {name: column[:5] for name, column in COLUMNS.items()}
    long = "a note of more than forty characters, which nothing cuts: " + 60 * "x"
    others = {"shot": np.arange(5.0), "note": [long, None, "b", "", "c"], "lab": "one", "ratio": 0.5, "nothing": None}
    found = pn.batch({**few, **others})
    assert found.columns[-5:] == ["shot", "note", "lab", "ratio", "nothing"]
    assert np.array_equal(found["depth_m"], DEPTHS[:5]) and found["shot"].tolist() == [0, 1, 2, 3, 4]
    assert found["note"].tolist() == [long, None, "b", "", "c"] and found["lab"].tolist() == ["one"] * 5
    assert found["ratio"].tolist() == [0.5] * 5 and found.to_pandas()["note"][0] == long
    times = pa.array(np.array(["2024-01-01", "2024-01-02"] * 20_000, dtype="datetime64[s]"))
    table = pa.table({"id": pa.array(range(COUNT), pa.int64()), **COLUMNS, "time": times})
    out = pn.batch(table, threads=2).to_arrow()
    assert out["id"].type == pa.int64() and out["id"].combine_chunks() == table["id"].combine_chunks()
    assert out["time"].combine_chunks() == times and np.array_equal(out["depth_m"].to_numpy(), DEPTHS)
    assert pn.batch(table.slice(0, 3))["id"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("name", ["depth_m", "row", "velocty_m_s", "thickness", "impact.velocity"])
def test_columns_that_cannot_go_with_their_rows(name):
    with pytest.raises(pn.TableError, match=name.replace(".", r"\.")):
        pn.batch({**{known: column[:2] for known, column in COLUMNS.items()}, name: [1.0, 2.0]})
