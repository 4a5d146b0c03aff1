//! `penetrode map`: how far Eq. 11-12 may be trusted, over (I, N).

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::output::{Text, check_table, significant, write_table};
use super::{Answer, Ask, CliError, Exit};
use crate::exchange::tables::{Value, push_line};
use crate::physics::Shown;
use crate::report::chart::extremes;
use crate::report::sweep_figures;
use crate::studies::applicability::{self, LEVELS, Line};
use crate::studies::experiments::{self, MarkedScene};

/// Arguments of `map`.
#[derive(Args, Debug)]
#[command(after_help = include_str!("help/map.txt"))]
pub struct MapArgs {
    /// Crater depth in diameters.
    #[arg(long, default_value_t = 2.0, allow_hyphen_values = true)]
    pub k: f64,
    /// Write the lines to this CSV file and the figure beside it.
    ///
    /// - is standard output, without a figure.
    #[arg(long, value_name = "F.csv")]
    pub out: Option<PathBuf>,
}

/// What `map --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MapJson {
    /// `penetrode/map/1`.
    pub schema: &'static str,
    /// Crater depth in diameters.
    pub k: f64,
    /// Lines of equal error.
    pub lines: Vec<Line>,
    /// Scenes of the measured data, each with its own k.
    pub scenes: Vec<MarkedScene>,
}

impl Ask for MapArgs {
    type Answer = MapJson;

    fn table(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn ask(&self) -> Result<Answer<MapJson>, CliError> {
        if !(self.k.is_finite() && self.k > 0.0) {
            return Err(CliError::usage(format!("--k {} is not allowed", Shown(self.k)), "give a number above zero"));
        }
        check_table(&[], self.table(), &[""])?;
        let scenes = experiments::marked(&experiments::shipped()?);
        let map = MapJson { schema: "penetrode/map/1", k: self.k, lines: applicability::lines(self.k), scenes };
        if let Some(path) = &self.out {
            let mut csv = "level,I,N\n".to_owned();
            for line in &map.lines {
                let cells = |(i, n): &(f64, f64)| [line.level, *i, *n].map(|number| Value::Number(Some(number)));
                line.points.iter().for_each(|point| push_line(&mut csv, &cells(point)));
            }
            let figure = sweep_figures::applicability(self.k, &map.lines, &map.scenes, &[]);
            write_table(path, Ok(csv.into_bytes()), &[""], [figure])?;
        }
        Ok(Answer { text: map.text(), data: Some(map), exit: Exit::Success })
    }
}

impl MapJson {
    fn text(&self) -> String {
        let mut text = Text::default();
        text.line(format!("Error of Eq. 11-12 against the equation of motion, k = {}", Shown(self.k)));
        text.line("  least N for an error within");
        let impacts = [0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
        let least = |impact, level| applicability::geometry_at(level, impact, self.k);
        let row = |impact| {
            let cells = LEVELS.map(|level| least(impact, level).map_or("any".to_owned(), significant));
            [significant(impact)].into_iter().chain(cells).collect::<Vec<_>>()
        };
        text.table(&["I", "1 %", "5 %", "20 %"], impacts.map(row));
        text.gap();
        let sets = self.scenes.chunk_by(|a, b| a.set == b.set).map(|of_set| {
            let range = |get: fn(&MarkedScene) -> f64| extremes(of_set.iter().map(get)).unwrap_or_default();
            let [impact, geometry, error] = [range(|s| s.impact), range(|s| s.geometry), range(|s| s.error)];
            let within = of_set.iter().filter(|s| s.error.abs() <= applicability::ERROR_ALLOWED).count();
            [
                of_set[0].set.clone(),
                of_set.len().to_string(),
                format!("{:.2} to {:.1}", impact[0], impact[1]),
                format!("{:.1} to {:.1}", geometry[0], geometry[1]),
                format!("{:+.1} to {:+.1}", 100.0 * error[0], 100.0 * error[1]),
                within.to_string(),
            ]
        });
        text.table(&["measured set", "tests", "I", "N", "error, %", "in 5 %"], sets);
        text.finish()
    }
}
