//! `penetrode init KIND [PATH]`: a file to begin with, which runs as it stands.
//!
//! What is written is a file of `templates/`; its first lines say how it is used, and are what the command prints.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::output::{Text, check_place, print_text, write_all};
use super::{CliError, Exit, Run};
use crate::exchange::input::is_standard;

/// Arguments of `init`.
#[derive(Args, Debug)]
#[command(after_help = "Examples: penetrode init peer\n          penetrode init peer own_solver.f90\n\n\
    A file that is there is never replaced.")]
pub struct InitArgs {
    /// What the file is.
    #[arg(value_enum, value_name = "peer|scene|suite|data")]
    pub kind: Kind,
    /// The file, or - for standard output [default: peer.py, scene.toml, suite.toml or data.csv].
    pub path: Option<PathBuf>,
    /// Language of a peer [default: that of the ending of PATH, or python].
    #[arg(long, value_enum)]
    pub language: Option<Language>,
}

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A solver of your own, which `diagnose` and `verify` ask.
    Peer,
    /// A scene.
    Scene,
    /// A suite of claims for `verify`.
    Suite,
    /// Results at several step sizes for `audit`.
    Data,
}

/// A language of peers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Language {
    /// Python 3, its standard library.
    Python,
    /// C++17.
    Cpp,
    /// Fortran 2008.
    Fortran,
    /// Julia, without packages.
    Julia,
    /// Octave 7.
    Octave,
}

/// A file to begin with.
#[derive(Debug)]
struct Template {
    /// Its name where none is given; its own text uses it.
    name: &'static str,
    /// Endings of names that fit.
    endings: &'static [&'static str],
    text: &'static str,
}

macro_rules! template {
    ($name:literal, $($ending:literal),+) => {
        Template { name: $name, endings: &[$($ending),+], text: include_str!(concat!("templates/", $name)) }
    };
}

impl Language {
    const fn template(self) -> Template {
        match self {
            Self::Python => template!("peer.py", "py"),
            Self::Cpp => template!("peer.cpp", "cpp", "cc", "cxx"),
            Self::Fortran => template!("peer.f90", "f90", "f95", "f03", "f08"),
            Self::Julia => template!("peer.jl", "jl"),
            Self::Octave => template!("peer.m", "m"),
        }
    }
}

impl Run for InitArgs {
    fn run(&self) -> Result<Exit, CliError> {
        let template = self.template()?;
        let path = self.path.clone().unwrap_or_else(|| template.name.into());
        if !is_standard(&path) {
            check_place("the file", &path)?;
            if fs::symlink_metadata(&path).is_ok() {
                let message = format!("{} is there already, and no file is replaced", path.display());
                let help = format!("name another: `penetrode init {} PATH`", self.kind_name());
                return Err(CliError::usage(message, help));
            }
        }
        let named = template.text_for(&path);
        let text = named.as_deref().unwrap_or(template.text);
        write_all(&[(path.clone(), text.into())])?;
        if is_standard(&path) {
            return Ok(Exit::Success);
        }
        let instead = if named.is_some() { String::new() } else { format!(", with that name for {}", template.name) };
        let mut said = Text::titled(Some(&format!("{} is written. Next{instead}:", path.display())));
        said.lines(commands(text).map(|command| format!("  {command}")));
        print_text(&said.finish()).map_err(CliError::stdout)?;
        Ok(Exit::Success)
    }
}

impl InitArgs {
    fn kind_name(&self) -> String {
        self.kind.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What is written. The language is that of the file's ending, and must be the one that is named.
    fn template(&self) -> Result<Template, CliError> {
        let template = match self.kind {
            Kind::Peer => self.language()?.template(),
            _ if self.language.is_some() => {
                return Err(CliError::usage(format!("a {} has no language", self.kind_name()), "leave out --language"));
            }
            Kind::Scene => template!("scene.toml", "toml"),
            Kind::Suite => template!("suite.toml", "toml"),
            Kind::Data => template!("data.csv", "csv"),
        };
        match self.path.as_deref().filter(|path| !is_standard(path)) {
            Some(path) if !template.fits(path) => {
                let message = format!("{} is no name of such a file", path.display());
                Err(CliError::usage(message, format!("let it end with .{}", template.endings.join(" or ."))))
            }
            _ => Ok(template),
        }
    }

    fn language(&self) -> Result<Language, CliError> {
        let named = self.path.as_deref().filter(|path| !is_standard(path));
        match (self.language, named) {
            (Some(language), _) => Ok(language),
            (None, None) => Ok(Language::Python),
            (None, Some(path)) => {
                let fitting = Language::value_variants().iter().find(|language| language.template().fits(path));
                let endings = Language::value_variants().iter().map(|language| language.template().endings[0]);
                fitting.copied().ok_or_else(|| {
                    let message = format!("the ending of {} is that of no language known here", path.display());
                    CliError::usage(message, format!("the endings are .{}", endings.collect::<Vec<_>>().join(", .")))
                })
            }
        }
    }
}

impl Template {
    fn fits(&self, path: &Path) -> bool {
        path.extension().is_some_and(|ending| self.endings.iter().any(|known| ending.eq_ignore_ascii_case(known)))
    }

    /// The text for a file at `path`: its commands name that file and the program that is made of it. `None` for a path
    /// that a shell or the language could take for something else.
    fn text_for(&self, path: &Path) -> Option<String> {
        let is_plain = |path: &str| path.chars().all(|c| c.is_alphanumeric() || "/._-".contains(c));
        let source = path.to_str().filter(|path| is_plain(path) && !path.starts_with('-'))?;
        let (program, _) = source.rsplit_once('.')?;
        let called = if program.contains('/') { program.to_owned() } else { format!("./{program}") };
        let renamed = self.text.replace(self.name, source).replace("./peer", &called);
        Some(renamed.replace("-o peer ", &format!("-o {program} ")))
    }
}

/// The commands that the first lines of a template give, with their remarks.
fn commands(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().take(10).map(|line| line.trim_start_matches(['/', '!', '%', '#']));
    let indented = lines.filter(|line| line.starts_with("    ")).map(str::trim);
    indented.filter(|line| ["penetrode ", "g++ ", "gfortran "].iter().any(|program| line.starts_with(program)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commands_of_a_template_name_the_file_that_it_is_written_to() {
        let of = |path: &str| {
            let text = Language::Cpp.template().text_for(Path::new(path))?;
            Some(
                commands(&text).map(|line| line.split("   ").next().unwrap_or_default().to_owned()).collect::<Vec<_>>(),
            )
        };
        for (path, build, program) in [
            ("peer.cpp", "-o peer peer.cpp", "./peer"),
            ("own.cc", "-o own own.cc", "./own"),
            ("of/my.own.cpp", "-o of/my.own of/my.own.cpp", "of/my.own"),
        ] {
            let diagnose = format!("penetrode diagnose {program}");
            let verify = format!("penetrode verify --only peer/user --peer {program}");
            assert_eq!(of(path), Some(vec![format!("g++ -O2 -std=c++17 {build}"), diagnose, verify]));
        }
        for path in ["a b.cpp", "$(x).cpp", "a\nb.cpp", "-x.cpp"] {
            assert_eq!(of(path), None);
        }
    }
}
