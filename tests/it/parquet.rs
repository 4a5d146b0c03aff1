//! Parquet tables from outside (`--features parquet`): the same bits as CSV on either side, and refusals at their place.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::parser::parse_message_type;

use crate::program::{names, run_in};

/// A cell: absent, the bits of a number, or text.
#[derive(Debug, PartialEq)]
enum Cell {
    Absent,
    Bits(u64),
    Text(String),
}

/// The columns of a Parquet table, by name.
fn columns(path: &Path) -> BTreeMap<String, Vec<Cell>> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let mut columns: BTreeMap<String, Vec<Cell>> = BTreeMap::new();
    for row in reader.get_row_iter(None).unwrap() {
        for (name, field) in row.unwrap().get_column_iter() {
            columns.entry(name.clone()).or_default().push(match field {
                Field::Null => Cell::Absent,
                Field::Double(value) => Cell::Bits(value.to_bits()),
                Field::Long(value) => Cell::Bits((*value as f64).to_bits()),
                Field::Str(text) => Cell::Text(text.clone()),
                other => unreachable!("{name}: {other}"),
            });
        }
    }
    columns
}

/// The columns of a CSV table, read as those of a Parquet table.
fn csv_columns(path: &Path) -> BTreeMap<String, Vec<Cell>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    let mut columns: BTreeMap<String, Vec<Cell>> = BTreeMap::new();
    for record in reader.records() {
        for (name, text) in header.iter().zip(&record.unwrap()) {
            columns.entry(name.to_owned()).or_default().push(match (text, text.parse::<f64>()) {
                ("", _) => Cell::Absent,
                (_, Ok(value)) => Cell::Bits(value.to_bits()),
                _ => Cell::Text(text.to_owned()),
            });
        }
    }
    columns
}

const NEEDED: [&str; 6] = ["mass_kg", "diameter_m", "nose_factor", "strength_pa", "density_kg_m3", "velocity_m_s"];
const GOOD: [f64; 6] = [2.0, 0.05, 0.72, 36e6, 2300.0, 300.0];

/// Columns of numbers in the language of schemas.
fn optional_doubles(names: &[&str]) -> String {
    names.iter().map(|name| format!("optional double {name};")).collect::<Vec<_>>().join(" ")
}

/// Columns of numbers as a Parquet table.
fn write_numbers(path: &Path, names: &[&str], rows: &[Vec<Option<f64>>], compression: Compression) {
    let fields = optional_doubles(names);
    let schema = Arc::new(parse_message_type(&format!("message scenes {{ {fields} }}")).unwrap());
    let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
    let mut writer = SerializedFileWriter::new(File::create(path).unwrap(), schema, properties).unwrap();
    // Two rows a group, so that chunks and row groups do not coincide.
    for rows in rows.chunks(2) {
        let mut group = writer.next_row_group().unwrap();
        for column in 0..names.len() {
            let mut writer = group.next_column().unwrap().unwrap();
            let levels: Vec<i16> = rows.iter().map(|row| i16::from(row[column].is_some())).collect();
            let values: Vec<f64> = rows.iter().filter_map(|row| row[column]).collect();
            writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None).unwrap();
            writer.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.close().unwrap();
}

fn good_rows(count: usize) -> Vec<Vec<Option<f64>>> {
    (0..count)
        .map(|i| {
            GOOD.iter().enumerate().map(|(c, value)| Some(if c == 5 { value + i as f64 } else { *value })).collect()
        })
        .collect()
}

#[test]
fn results_have_the_bits_of_csv_over_several_row_groups() {
    // 70,000 rows are more than one row group, and more than one chunk of the program.
    let folder = tempfile::tempdir().unwrap();
    for out in ["r.csv", "r.parquet"] {
        run_in(folder.path(), &format!("batch random:70000:3 --out {out}")).expect(0);
    }
    let path = folder.path().join("r.parquet");
    let found = columns(&path);
    assert_eq!(found["row"].len(), 70_000);
    assert_eq!(found, csv_columns(&folder.path().join("r.csv")));
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    assert!(reader.num_row_groups() > 1 && reader.num_row_groups() < 10, "{}", reader.num_row_groups());
}

#[test]
fn scenes_are_those_of_the_same_csv_whatever_the_compression() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["velocity_m_s", "mass_kg", "diameter_m", "nose_factor", "strength_pa", "density_kg_m3", "thickness_m"];
    let mut rows = Vec::new();
    let mut text = names.join(",") + "\n";
    for i in 0..25 {
        let thickness = (i % 3 == 0).then_some(0.1 + 0.01 * f64::from(i));
        let speed = 100.0 + f64::from(i) / 3.0;
        rows.push(vec![Some(speed), Some(2.0), Some(0.05), Some(0.72), Some(36e6), Some(2300.0), thickness]);
        let cell = thickness.map_or(String::new(), |value| value.to_string());
        text += &format!("{speed},2,0.05,0.72,36e6,2300,{cell}\n");
    }
    fs::write(folder.path().join("s.csv"), text).unwrap();
    run_in(folder.path(), "batch s.csv --out r.csv --critical").expect(0);
    for (compression, scenes) in [(Compression::UNCOMPRESSED, "s.parquet"), (Compression::SNAPPY, "s.PARQUET")] {
        write_numbers(&folder.path().join(scenes), &names, &rows, compression);
        run_in(folder.path(), &format!("batch {scenes} --out r.parquet --critical")).expect(0);
        assert_eq!(columns(&folder.path().join("r.parquet")), csv_columns(&folder.path().join("r.csv")));
    }
}

#[test]
fn integers_and_text_are_read_as_what_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.parquet");
    let schema = "message scenes { required int64 mass_kg; required double diameter_m; required double nose_factor;
        required int64 strength_pa; required int64 density_kg_m3; required int64 velocity_m_s;
        required double thickness_m; required int32 S (UINT_32); optional binary criterion (UTF8); }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut writer = SerializedFileWriter::new(File::create(&path).unwrap(), schema, Arc::default()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for (index, value) in [2.0, 0.05, 0.72, 36e6, 2300.0, 300.0, 0.12, f64::NAN, f64::NAN].into_iter().enumerate() {
        let mut column = group.next_column().unwrap().unwrap();
        match index {
            0 | 3 | 4 | 5 => column.typed::<Int64Type>().write_batch(&[value as i64; 3], None, None).unwrap(),
            // 4,294,967,290 without a sign: an outrageous strength factor, and no negative one.
            7 => column.typed::<parquet::data_type::Int32Type>().write_batch(&[12, 12, -6], None, None).unwrap(),
            8 => {
                let texts = [ByteArray::from("ndrc"), ByteArray::from("half")];
                column.typed::<ByteArrayType>().write_batch(&texts, Some(&[1, 1, 0]), None).unwrap()
            }
            _ => column.typed::<DoubleType>().write_batch(&[value; 3], None, None).unwrap(),
        };
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    run_in(folder.path(), "batch s.parquet --out r.csv").expect(3);
    let text = fs::read_to_string(folder.path().join("r.csv")).unwrap();
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert!(lines[0].starts_with("1,perforated,"), "{text}");
    assert_eq!(lines[1], "2,,,,,,,,,,\"row 2, column 9: `half` in `criterion` is not full-depth or ndrc\"");
    assert!(lines[2].starts_with("3,stopped-in-crater,"), "{text}");
}

/// Behind 2^53 an `f64` is another integer: a label that is kept would name another row.
#[test]
fn a_kept_integer_that_no_number_holds_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (labels, is_right) in [([(1_i64 << 53) - 1, 3], true), ([(1 << 53) + 1, 3], false)] {
        let numbers = NEEDED.map(|name| format!("required double {name}; ")).concat();
        let schema = format!("message scenes {{ {numbers}required int64 label; required int64 other; }}");
        let schema = Arc::new(parse_message_type(&schema).unwrap());
        let file = File::create(folder.path().join("s.parquet")).unwrap();
        let mut writer = SerializedFileWriter::new(file, schema, Arc::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        for value in good_rows(1)[0].iter().copied().chain([None, None]) {
            let mut column = group.next_column().unwrap().unwrap();
            match value {
                Some(number) => column.typed::<DoubleType>().write_batch(&[number; 2], None, None).unwrap(),
                None => column.typed::<Int64Type>().write_batch(&labels, None, None).unwrap(),
            };
            column.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        if is_right {
            run_in(folder.path(), "batch s.parquet --out r.csv").expect(0);
        } else {
            let refused = run_in(folder.path(), "batch s.parquet --out other.csv").refused();
            assert!(refused.contains("`label` holds integers beyond 2^53"), "{refused}");
        }
    }
}

#[test]
fn a_bad_row_says_what_is_wrong_and_the_others_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = good_rows(5);
    rows[1][0] = None;
    rows[2][5] = Some(f64::NAN);
    rows[3][2] = Some(1.5);
    write_numbers(&folder.path().join("s.parquet"), &NEEDED, &rows, Compression::UNCOMPRESSED);
    let said = run_in(folder.path(), "batch s.parquet --out r.parquet").expect(3);
    assert_eq!(said.err, "5 rows: 3 bad, 0 undecided\n");
    let found = columns(&folder.path().join("r.parquet"));
    let Cell::Text(outside) = &found["error"][3] else { unreachable!("{:?}", found["error"]) };
    assert!(outside.contains("nose factor"), "{outside}");
    assert_eq!(found["error"][1], Cell::Text("row 2, column 1: the cell in `mass_kg` is empty".to_owned()));
    assert_eq!(found["error"][2], Cell::Text("row 3, column 6: `NaN` in `velocity_m_s` is not finite".to_owned()));
    assert_eq!((&found["error"][0], &found["depth_m"][1]), (&Cell::Absent, &Cell::Absent));
    assert!(matches!(found["depth_m"][4], Cell::Bits(_)));
    // A part that leaves out a whole row group counts its rows as the table does.
    run_in(folder.path(), "batch s.parquet --part 3/5 --out p.parquet").expect(3);
    assert_eq!(columns(&folder.path().join("p.parquet"))["error"], found["error"][2..3]);
}

#[test]
fn a_table_that_cannot_be_used_is_refused_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().join("s.parquet");
    let refusal = || {
        let refused = run_in(folder.path(), "batch s.parquet --out r.parquet").refused();
        assert_eq!(names(folder.path()), ["s.parquet"]);
        refused
    };
    write_numbers(&scenes, &NEEDED[..5], &[vec![Some(1.0); 5]], Compression::UNCOMPRESSED);
    assert!(refusal().starts_with("error: s.parquet: the column `velocity_m_s` is missing "));
    let mut names = NEEDED;
    names[1] = "diametre_m";
    write_numbers(&scenes, &names, &good_rows(1), Compression::UNCOMPRESSED);
    assert!(refusal().contains("s.parquet, column 2: there is no column `diametre_m`; is `diameter_m` meant?"));
    for (column, words) in [
        ("optional binary mass_kg (UTF8);", "the column `mass_kg` holds BYTE_ARRAY (UTF8), not numbers"),
        ("optional boolean mass_kg;", "holds BOOLEAN, not numbers"),
        ("optional int32 mass_kg (DATE);", "not numbers"),
        ("repeated double mass_kg;", "holds lists, not numbers"),
        ("optional double mass_kg; optional double criterion;", "the column `criterion` holds DOUBLE, not text"),
        ("optional group mass_kg { optional double kg; }", "there is no column `mass_kg.kg`"),
    ] {
        let others = optional_doubles(&NEEDED[1..]);
        let schema = Arc::new(parse_message_type(&format!("message s {{ {column} {others} }}")).unwrap());
        let writer = SerializedFileWriter::new(File::create(&scenes).unwrap(), schema, Arc::default()).unwrap();
        writer.close().unwrap();
        let said = refusal();
        assert!(said.contains(words), "{column}: {said}");
    }
    fs::write(&scenes, "mass_kg,diameter_m\n2,0.05\n").unwrap();
    assert!(refusal().starts_with("error: s.parquet: not a sound Parquet table: "));
    fs::write(&scenes, "").unwrap();
    assert!(refusal().contains("s.parquet: not a sound Parquet table: "));
    write_numbers(&scenes, &NEEDED, &good_rows(50), Compression::UNCOMPRESSED);
    let whole = fs::read(&scenes).unwrap();
    fs::write(&scenes, &whole[..whole.len() / 2]).unwrap();
    assert!(refusal().contains("not a sound Parquet table"));
}

#[test]
fn a_damaged_table_is_refused_or_read_but_never_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().join("s.parquet");
    write_numbers(&scenes, &NEEDED, &good_rows(9), Compression::SNAPPY);
    let whole = fs::read(&scenes).unwrap();
    // A byte in about sixty places, the footer and the page headers among them.
    for place in (4..whole.len()).step_by(whole.len() / 60) {
        let mut damaged = whole.clone();
        damaged[place] ^= 0x55;
        fs::write(&scenes, damaged).unwrap();
        let said = run_in(folder.path(), "batch s.parquet --out r.csv");
        assert!([0, 2, 3].contains(&said.code), "byte {place}: {said:?}");
        assert_eq!(folder.path().join("r.csv").exists(), said.code != 2, "byte {place}");
        let _ = fs::remove_file(folder.path().join("r.csv"));
    }
}

#[test]
fn a_table_without_rows_has_results_without_rows() {
    let folder = tempfile::tempdir().unwrap();
    write_numbers(&folder.path().join("s.parquet"), &NEEDED, &[], Compression::UNCOMPRESSED);
    run_in(folder.path(), "batch s.parquet --out r.parquet").expect(0);
    let reader = SerializedFileReader::new(File::open(folder.path().join("r.parquet")).unwrap()).unwrap();
    assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
    assert_eq!(reader.metadata().file_metadata().schema_descr().num_columns(), 11);
}

#[test]
fn a_sweep_writes_the_bits_of_its_csv() {
    let folder = tempfile::tempdir().unwrap();
    for out in ["t.csv", "t.parquet"] {
        let vary = "--vary H/d=0.5:18:9 --vary projectile.mass=-1kg:10kg:3";
        run_in(folder.path(), &format!("sweep @paper-slab {vary} --out {out}")).expect(3);
    }
    let found = columns(&folder.path().join("t.parquet"));
    assert_eq!(found, csv_columns(&folder.path().join("t.csv")));
    assert_eq!((found["H/d"].len(), found.len()), (27, 15));
    assert!(found["error"].iter().any(|cell| matches!(cell, Cell::Text(_))));
}

/// The CSV with the same cells has the same results.
#[test]
fn columns_that_are_not_read_go_with_their_rows() {
    let folder = tempfile::tempdir().unwrap();
    let names = [&NEEDED[..], &["measured"]].concat();
    let rows: Vec<Vec<Option<f64>>> =
        (0..5).map(|i| GOOD.into_iter().map(Some).chain([(i != 2).then_some(0.1 + f64::from(i))]).collect()).collect();
    write_numbers(&folder.path().join("s.parquet"), &names, &rows, Compression::SNAPPY);
    let said = run_in(folder.path(), "batch s.parquet --out r.parquet").expect(0);
    assert!(said.words().contains("passed on unread: measured"), "{}", said.words());
    let cell = |row: &Vec<Option<f64>>| row[6].map_or(Cell::Absent, |value| Cell::Bits(value.to_bits()));
    assert_eq!(columns(&folder.path().join("r.parquet"))["measured"], rows.iter().map(cell).collect::<Vec<_>>());
    run_in(folder.path(), "batch s.parquet --out r.csv").expect(0);
    assert_eq!(columns(&folder.path().join("r.parquet")), csv_columns(&folder.path().join("r.csv")));
    // Texts of CSV are texts of Parquet, of any length.
    let long = "x".repeat(500);
    let line = GOOD.map(|value| value.to_string()).join(",");
    fs::write(folder.path().join("s.csv"), format!("{},note\n{line},{long}\n{line},\n", NEEDED.join(","))).unwrap();
    run_in(folder.path(), "batch s.csv --out t.parquet").expect(0);
    let texts = [Cell::Text(long), Cell::Absent];
    assert_eq!(columns(&folder.path().join("t.parquet"))["note"], texts);
}
