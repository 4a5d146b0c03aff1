//! A row of measured tests: the scene of the shot, and what was measured of it.
//!
//! Projectile and target have the columns of `batch`, under their names or the usual symbols and in any unit. A row may measure a depth, a
//! residual velocity, an outcome, a ballistic limit, or several of them. A shot that perforated has no depth, whatever its row says,
//! and a row that cannot be used costs no other.

use super::Experiment;
use crate::exchange::tables::{self, Column, Format, Need, Others, Row, TableError};
use crate::physics::units::Dimension;
use crate::physics::{Parameter, Range, Resistance, Scene};
use crate::studies::batch::{self, RowError};

/// A measured number and its standard uncertainty, where that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Value, SI.
    pub value: f64,
    /// Standard uncertainty, SI.
    pub uncertainty: Option<f64>,
}

/// A shot and what was measured of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Name of its set.
    pub set: String,
    /// Line in its file, from 1.
    pub line: u64,
    /// Projectile, target with its thickness where that is known, impact velocity unless a limit alone was measured.
    pub scene: Scene,
    /// Depth of a shot that did not perforate (m).
    pub depth: Option<Measured>,
    /// Residual velocity (m/s).
    pub residual: Option<Measured>,
    /// Ballistic limit of the target (m/s).
    pub limit: Option<Measured>,
    /// Interval of the limit (m/s): as given, or two standard uncertainties to either side.
    pub limit_interval: Option<[f64; 2]>,
    /// Whether it perforated, where that is known.
    pub perforated: Option<bool>,
    /// True if the row gives a depth to a shot that perforated.
    pub has_depth_of_perforation: bool,
    /// Why it does not count, where its row says so.
    pub excluded: Option<String>,
    /// Cells of the columns that are not read, as they stand.
    pub others: Vec<String>,
}

/// A table of shots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shots {
    /// Those that can be used, excluded ones among them.
    pub shots: Vec<Shot>,
    /// Why rows cannot be used.
    pub refused: Vec<TableError>,
    /// Names of the columns that are not read.
    pub others: Vec<String>,
}

/// A table of measured tests; columns of other names are kept and not read, and one written wrongly is refused.
pub static EXPERIMENTS: Format = Format { columns: &COLUMNS, others: Others::Ignored, has_comments: false };

/// Index of the first column behind those of a scene.
const FIRST: usize = batch::COLUMNS.len();

const MEASURED: [Column; 11] = [
    Column::number("depth_m")
        .measured("depth", Dimension::Length)
        .called(&["X", "penetration"])
        .within(Range::Positive),
    Column::number("depth_uncertainty_m").measured("depth_uncertainty", Dimension::Length).within(Range::NotNegative),
    Column::number("residual_velocity_m_s")
        .measured("residual_velocity", Dimension::Velocity)
        .called(&["Vr", "V_r", "VR"])
        .within(Range::NotNegative),
    Column::number("residual_velocity_uncertainty_m_s")
        .measured("residual_velocity_uncertainty", Dimension::Velocity)
        .called(&["Vr_uncertainty"])
        .within(Range::NotNegative),
    Column::number("ballistic_limit_m_s")
        .measured("ballistic_limit", Dimension::Velocity)
        .called(&["V50", "Vbl", "V_bl", "Vc", "V_c", "limit"])
        .within(Range::Positive),
    Column::number("ballistic_limit_uncertainty_m_s")
        .measured("ballistic_limit_uncertainty", Dimension::Velocity)
        .called(&["V50_uncertainty", "limit_uncertainty"])
        .within(Range::NotNegative),
    Column::number("ballistic_limit_low_m_s")
        .measured("ballistic_limit_low", Dimension::Velocity)
        .called(&["V50_low", "limit_low"])
        .within(Range::NotNegative),
    Column::number("ballistic_limit_high_m_s")
        .measured("ballistic_limit_high", Dimension::Velocity)
        .called(&["V50_high", "limit_high"])
        .within(Range::Positive),
    Column::text("outcome").called(&["result"]),
    Column::text("excluded").called(&["exclude"]),
    Column::text("test_set").called(&["set", "series"]),
];

const COLUMNS: [Column; FIRST + MEASURED.len()] = {
    let mut columns = [Column::text(""); FIRST + MEASURED.len()];
    let mut index = 0;
    while index < FIRST {
        columns[index] = batch::COLUMNS[index];
        index += 1;
    }
    while index < columns.len() {
        columns[index] = MEASURED[index - FIRST].needed(Need::Optional);
        index += 1;
    }
    // A measured limit has no impact velocity, and k follows from the nose.
    let mut index = 0;
    while index < batch::CRITERION {
        columns[index].range = Parameter::PLAIN[index].entry().range;
        index += 1;
    }
    columns[batch::VELOCITY].range = Range::Positive;
    columns[batch::VELOCITY].need = Need::Optional;
    columns[batch::CRATER_RATIO].need = Need::Optional;
    columns
};

const OUTCOMES: &str = "neither perforated (go, complete) nor stopped (embedded, no-go, partial, rebound)";

/// The shots of the table `bytes`, called `file` in messages; `name` is the set of those that name none.
///
/// # Errors
/// [`TableError`] of a table of which no row can be read; of its first row, where none can be used.
pub fn read(file: &str, bytes: &[u8], name: &str) -> Result<Shots, Box<TableError>> {
    let mut others = Vec::new();
    let rows = tables::read_rows(file, bytes, &EXPERIMENTS, |row| {
        if others.is_empty() {
            others = row.others().map(|(_, name)| name.to_owned()).collect();
        }
        shot_of(row, name)
    })?;
    let mut found = Shots { others, ..Shots::default() };
    for row in rows {
        match row {
            Ok(shot) => found.shots.push(shot),
            Err(error) => found.refused.push(*error),
        }
    }
    match found.refused.first() {
        Some(first) if found.shots.is_empty() => Err(Box::new(first.clone())),
        _ => Ok(found),
    }
}

/// What a word of the column `outcome` says; `None` for an unknown one.
fn outcome_of(word: &str) -> Option<bool> {
    let word: String = word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    match word.as_str() {
        "perforated" | "perforation" | "go" | "complete" | "completepenetration" | "cp" => Some(true),
        "stopped" | "stop" | "embedded" | "nogo" | "partial" | "partialpenetration" | "pp" | "rebound"
        | "rebounded" => Some(false),
        _ => None,
    }
}

fn shot_of(row: &Row<'_>, name: &str) -> Result<Shot, Box<TableError>> {
    let [depth, residual, limit, low, high, outcome, excluded, set] =
        [0, 2, 4, 6, 7, 8, 9, 10].map(|index| FIRST + index);
    let measured = |value: usize| -> Result<Option<Measured>, Box<TableError>> {
        let uncertainty = row.optional(value + 1)?;
        Ok(row.optional(value)?.map(|value| Measured { value, uncertainty }))
    };
    let shape = batch::nose_of(row)?;
    let crater_ratio = match (row.optional(batch::CRATER_RATIO)?, shape) {
        (Some(ratio), _) => ratio,
        (None, Some(shape)) => shape.crater_ratio(),
        (None, None) => {
            return Err(row.refuse_cell(
                batch::NOSE,
                "",
                "no shape of a nose, from which k follows: give k or the nose",
            ));
        }
    };
    let scene = batch::scene_with(row, shape, crater_ratio).map_err(|error| match error {
        RowError::Table(error) => error,
        other => row.refuse_row(other.to_string()),
    })?;
    let (depth_cell, residual_cell, limit_cell) = (measured(depth)?, measured(residual)?, measured(limit)?);
    let word = row.text(outcome)?;
    let said = match outcome_of(word) {
        None if !word.is_empty() => return Err(row.refuse_cell(outcome, word, OUTCOMES)),
        said => said,
    };
    let leaves = residual_cell.is_some_and(|residual| residual.value > 0.0);
    if leaves && said == Some(false) {
        return Err(row.refuse_cell(outcome, word, "not the outcome of a shot with a residual velocity"));
    }
    let perforated = said.or(residual_cell.map(|_| leaves));
    let is_through = perforated == Some(true);
    if let (Some(Measured { value, .. }), Some(thickness), false) = (depth_cell, scene.thickness, is_through)
        && value >= thickness
    {
        let reason = "not below the thickness: a shot that perforates has an outcome, and no depth";
        return Err(row.refuse_cell(depth, row.text(depth)?, reason));
    }
    if is_through && scene.thickness.is_none() {
        return Err(row.refuse_empty(batch::THICKNESS));
    }
    let is_fired = depth_cell.is_some() || perforated.is_some();
    if is_fired && scene.velocity.is_none() {
        return Err(row.refuse_empty(batch::VELOCITY));
    }
    let limit_interval = match (limit_cell, row.optional(low)?, row.optional(high)?) {
        (Some(Measured { value, .. }), Some(least), Some(most)) => {
            if !(least <= value && value <= most) {
                return Err(row.refuse_cell(limit, row.text(limit)?, "not within its own interval"));
            }
            Some([least, most])
        }
        (Some(Measured { value, uncertainty: Some(u) }), None, None) => Some([value - 2.0 * u, value + 2.0 * u]),
        (_, None, None) => None,
        (_, Some(_), _) => return Err(row.refuse_empty(if limit_cell.is_none() { limit } else { high })),
        (_, None, Some(_)) => return Err(row.refuse_empty(if limit_cell.is_none() { limit } else { low })),
    };
    if limit_cell.is_some() && scene.thickness.is_none() {
        return Err(row.refuse_empty(batch::THICKNESS));
    }
    if !is_fired && limit_cell.is_none() {
        return Err(row.refuse_empty(depth));
    }
    // Numbers that no equation of motion can be made of.
    if let Err(error) = scene.resolve(scene.velocity.unwrap_or(100.0)) {
        return Err(row.refuse_row(error.to_string()));
    }
    let (excluded, set) = (row.text(excluded)?, row.text(set)?);
    let is_counted = ["", "no", "0", "false", "n"].contains(&excluded.to_lowercase().as_str());
    Ok(Shot {
        set: if set.is_empty() { name } else { set }.to_owned(),
        line: row.at().number(),
        depth: depth_cell.filter(|_| !is_through),
        residual: residual_cell.filter(|_| is_through),
        limit: limit_cell,
        limit_interval,
        // A depth inside a slab is a stop.
        perforated: perforated.or((depth_cell.is_some() && scene.thickness.is_some()).then_some(false)),
        has_depth_of_perforation: is_through && depth_cell.is_some(),
        excluded: (!is_counted).then(|| excluded.to_owned()),
        others: row.others().map(|(place, _)| row.cell(place).map(str::to_owned)).collect::<Result<_, _>>()?,
        scene,
    })
}

impl Shots {
    /// Adds those of another table, whose columns that are not read may be others.
    pub fn append(&mut self, mut other: Self) {
        for name in &other.others {
            if !self.others.contains(name) {
                self.others.push(name.clone());
            }
        }
        let count = self.others.len();
        for shot in &mut self.shots {
            shot.others.resize(count, String::new());
        }
        let places: Vec<_> =
            other.others.iter().map(|name| self.others.iter().position(|known| known == name).unwrap_or(0)).collect();
        for shot in &mut other.shots {
            let mut cells = vec![String::new(); count];
            for (cell, place) in shot.others.drain(..).zip(&places) {
                cells[*place] = cell;
            }
            shot.others = cells;
        }
        self.shots.extend(other.shots);
        self.refused.extend(other.refused);
    }
}

impl Shot {
    /// Its scene, with another k where `crater_ratio` is given.
    pub fn scene(&self, crater_ratio: Option<f64>) -> Scene {
        let mut scene = self.scene.clone();
        if let (Resistance::Concrete(concrete), Some(ratio)) = (&mut scene.resistance, crater_ratio) {
            concrete.crater_ratio = ratio;
        }
        scene
    }

    /// Set, diameter, nose factor and thickness, which a ballistic limit belongs to.
    pub(super) fn key(&self) -> (String, [Option<u64>; 3]) {
        let concrete = self.scene.concrete();
        let numbers = [concrete.map(|c| c.diameter), concrete.map(|c| c.nose_factor), self.scene.thickness];
        (self.set.clone(), numbers.map(|number| number.map(f64::to_bits)))
    }

    /// What of it lies outside the experiments of Eq. 14, where its S is left to that.
    pub fn outside_eq14(&self) -> Vec<String> {
        let concrete = self.scene.concrete().filter(|concrete| concrete.follows_eq14);
        concrete.zip(self.scene.velocity).map_or_else(Vec::new, |(c, speed)| c.use_of_eq14(speed).departures())
    }

    /// The depth that was measured, as an experiment in a target without a far side.
    pub fn experiment(&self) -> Option<Experiment> {
        let (depth, concrete) = self.depth.zip(self.scene.concrete())?;
        Some(Experiment {
            set: self.set.clone(),
            line: self.line,
            mass: self.scene.mass,
            concrete: concrete.clone(),
            thickness_m: self.scene.thickness,
            velocity_m_s: self.scene.velocity?,
            measured_depth_m: depth.value,
            data_uncertainty_m: depth.uncertainty,
        })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a missing value is a failed test")]
mod tests {
    use super::*;
    use crate::integrators::Taylor;
    use crate::studies::experiments::compare;

    const HEADER: &str = "M_kg,d_mm,nose,CRH,fc_MPa,rho_kg_m3,H_mm,V0_m_s,depth_mm,Vr_m_s,outcome,V50_m_s,V50_low_m_s,V50_high_m_s,excluded";

    /// The rows behind `0.5 kg, 25 mm, ogive 3, 40 MPa, 2300 kg/m³`.
    fn of(rows: &[&str]) -> Result<Shots, Box<TableError>> {
        let rows: Vec<String> = rows.iter().map(|row| format!("0.5,25,ogive,3,40,2300,{row}")).collect();
        read("own.csv", format!("{HEADER}\n{}\n", rows.join("\n")).as_bytes(), "own")
    }

    /// `H` begins `H_target`, and a misspelt name is none that goes unread: a depth under it would be lost without a word.
    #[test]
    fn a_name_that_begins_another_is_read_and_a_misspelt_one_is_refused() {
        let read_with = |name: &str, cell: &str| {
            let table =
                format!("M_kg,d_mm,nose,fc_MPa,rho_kg_m3,V0_m_s,depth_mm,{name}\n2,50,flat,40,2300,200,60,{cell}\n");
            read("own.csv", table.as_bytes(), "own")
        };
        for name in ["H_m", "H_target_m", "thickness_m"] {
            assert_eq!(read_with(name, "0.3").unwrap().shots[0].scene.thickness, Some(0.3), "{name}");
        }
        for name in ["thicknes_m", "Thickness_m", "thickness", "oucome", "residual_velocty_m_s", "exclude_d"] {
            let error = read_with(name, "").unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
        for name in ["note", "depth_ratio", "length_mm", "L_mm", "certainty", "source_row", "h_mm", "mass_of_sabot"] {
            let shots = read_with(name, "1").unwrap();
            assert_eq!(shots.others, [name], "{name}");
        }
        let through = read_with("outcome", "perforated").unwrap_err().to_string();
        assert!(through.contains("`thickness_m`") && through.contains("no such column"), "{through}");
    }

    #[test]
    fn a_row_says_what_was_measured_and_what_follows_from_it() {
        let rows = [
            "200,300,150,,,,,,",
            "200,500,200,,perforated,,,,",
            "200,500,,180.5,,,,,",
            "200,400,,0,,,,,",
            "200,420,,,no-go,,,,",
            "200,,,,,390,380,395,",
            ",300,150,,,,,,",
            "200,310,155,,embedded,,,,yaw of 8 degrees",
        ];
        let found = of(&rows).unwrap();
        let said: Vec<_> =
            found.shots.iter().map(|s| (s.depth.is_some(), s.residual.is_some(), s.perforated)).collect();
        let (stopped, through) = (Some(false), Some(true));
        let expected = [
            (true, false, stopped),
            (false, false, through),
            (false, true, through),
            (false, false, stopped),
            (false, false, stopped),
            (false, false, None),
            (true, false, None),
            (true, false, stopped),
        ];
        assert_eq!(said, expected);
        assert!(found.shots[1].has_depth_of_perforation && found.refused.is_empty());
        assert_eq!(found.shots[5].limit_interval, Some([380.0, 395.0]));
        assert_eq!(found.shots[7].excluded.as_deref(), Some("yaw of 8 degrees"));
        assert_eq!(found.shots.iter().filter_map(Shot::experiment).count(), 3);
    }

    #[test]
    fn a_row_that_contradicts_itself_costs_no_other() {
        let good = "200,300,150,,,,,,";
        for (bad, message) in [
            ("200,300,200,,,,,,", "column 9: `200` in `depth_mm` is not below the thickness"),
            (
                "200,500,,180,embedded,,,,",
                "column 11: `embedded` in `outcome` is not the outcome of a shot with a residual",
            ),
            ("200,500,,,ricochet,,,,", "column 11: `ricochet` in `outcome` is neither perforated"),
            (",500,,180,,,,,", "column 7: the cell in `H_mm` is empty"),
            ("200,,150,,,,,,", "column 8: the cell in `V0_m_s` is empty"),
            ("200,300,,,,,,,", "column 9: the cell in `depth_mm` is empty"),
            ("200,,,,,390,395,380,", "column 12: `390` in `V50_m_s` is not within its own interval"),
            ("200,,,,,390,380,,", "column 14: the cell in `V50_high_m_s` is empty"),
            (",,,,,390,,,", "column 7: the cell in `H_mm` is empty"),
            ("200,300,150,,,,,", "14 cells in a table of 15 columns"),
            ("-200,300,150,,,,,,", "column 7: `-200` in `H_mm` is not a number >= 0"),
            ("200,1e400,150,,,,,,", "column 8: `1e400` in `V0_m_s` is not a number > 0"),
        ] {
            let found = of(&[good, bad, good]).unwrap();
            let error = found.refused[0].to_string();
            assert!(error.starts_with("own.csv:3") && error.contains(message), "{error}");
            assert_eq!((found.shots.len(), found.refused.len()), (2, 1), "{bad}");
            assert!(of(&[bad]).is_err(), "{bad}");
        }
    }

    /// The same shot under the names of `batch`, in other units, with N* and k, and with R in place of S.
    #[test]
    fn a_table_of_batch_a_table_of_symbols_and_one_of_other_units_are_the_same_shot() {
        let expected = &of(&[",300,150,,,,,,"]).unwrap().shots[0];
        for table in [
            "mass_kg,diameter_m,nose,CRH,strength_pa,density_kg_m3,velocity_m_s,depth_m\n0.5,0.025,ogive,3,40e6,2300,300,0.15\n",
            "mass_g,d (mm),nose,fc_MPa,rho_kg_m3,V0_km_s,X_mm,operator\n500,25,Ogive (CRH 3),40,2300,0.3,150,me\n",
        ] {
            let found = read("own.csv", table.as_bytes(), "own").unwrap();
            assert_eq!((&found.shots[0].scene, found.shots[0].depth), (&expected.scene, expected.depth), "{table}");
            assert_eq!(found.others.len(), found.shots[0].others.len());
        }
        let stated =
            "M_kg,d_mm,nose_factor,k,fc_MPa,R_MPa,rho_kg_m3,V0_m_s,depth_mm\n0.5,25,0.1,2,40,480,2300,300,150\n";
        let found = read("own.csv", stated.as_bytes(), "own").unwrap();
        let concrete = found.shots[0].scene.concrete().unwrap();
        assert!(concrete.static_factor == 12.0 && !concrete.follows_eq14 && concrete.crater_ratio == 2.0);
        assert!(found.shots[0].outside_eq14().is_empty());
        let without_k = stated.replace(",k,", ",x,");
        let error = read("own.csv", without_k.as_bytes(), "own").unwrap_err().to_string();
        assert!(error.contains("from which k follows"), "{error}");
    }

    #[test]
    fn every_nose_is_read_by_its_word_and_its_number() {
        let table = |nose: &str, number: &str| {
            let row = format!(
                "M_kg,d_mm,nose,CRH,tip_ratio,fc_MPa,rho_kg_m3,V0_m_s,depth_mm\n0.5,25,{nose},{number},0.4,40,2300,300,150\n"
            );
            let found = read("own.csv", row.as_bytes(), "own").map_err(|error| error.to_string())?;
            Ok::<_, String>(found.shots[0].scene.concrete().unwrap().nose_factor)
        };
        for (nose, number, factor) in [
            ("flat", "", 1.0),
            ("hemispherical(CRH 0.5)", "", 0.5),
            ("hemispherical", "", 0.5),
            ("spherical", "0.5", 0.5),
            ("Ogive", "2", 0.15625),
            ("conical", "1", 0.2),
            ("truncated ogive", "3", 0.2298),
            ("truncated-cone", "1.5", 0.192_307_692_307_692_3),
        ] {
            assert!((table(nose, number).unwrap() - factor).abs() < 1e-15, "{nose}");
        }
        for (nose, number) in [("ogive", ""), ("ogive", "0.3"), ("ogive (CRH 3)", "2"), ("pointed", "1"), ("cone", "0")]
        {
            assert!(table(nose, number).is_err(), "{nose}");
        }
    }

    #[test]
    fn tables_with_other_columns_are_one_with_all_of_them() {
        let table = |others: &str, cells: &str| {
            let text = format!(
                "M_kg,d_mm,nose,fc_MPa,rho_kg_m3,V0_m_s,depth_mm,{others}\n0.5,25,flat,40,2300,300,50,{cells}\n"
            );
            read("own.csv", text.as_bytes(), "own").unwrap()
        };
        let mut all = table("shot,note", "1,a");
        all.append(table("note,angle", "b,3"));
        assert_eq!(all.others, ["shot", "note", "angle"]);
        let cells: Vec<_> = all.shots.iter().map(|shot| shot.others.clone()).collect();
        assert_eq!(cells, [["1", "a", ""], ["", "b", "3"]]);
        assert!(compare(&super::super::depths(&all.shots), None, &[], &Taylor::default()).is_ok());
    }
}
