//! What reports write for LaTeX compiles: the tables, the paragraph on uncertainty and the references, in one paper.
//!
//! Where `pdflatex` or `bibtex` is missing, the tests say so in one line and count as ignored; with `CI=true` they fail.

use std::fs;
use std::path::Path;
use std::process::Command;

use libtest_mimic::Trial;

use crate::trials::{Check, Failure, ensure, required, trial};

/// A paper, as somebody would write it.
const PAPER: &str = "\\documentclass{article}\n\\usepackage{booktabs}\n\\begin{document}\n\\input{table}\n\\input{uncertainty}\n\
                     \\nocite{*}\n\\bibliographystyle{plain}\n\\bibliography{references}\n\\end{document}\n";

/// A table with more columns than fit a page.
const TABLE: &str = "dt_s,depth_m,time_s,peak_force_kn,mean_force_kn,work_kj,mass_kg\n\
                     4e-6,0.1461,0.00083,816,1.16,2.16,3.16\n2e-6,0.1455,0.000828,804,1.04,2.04,3.04\n\
                     1e-6,0.1452,0.000827,801,1.01,2.01,3.01\n5e-7,0.14505,0.0008265,800.25,1.0025,2.0025,3.0025\n";

/// A solver whose name is LaTeX, with letters of other scripts.
const NAME: &str = "50 % & #1~^_$\\\\input{x} \u{4e2d} Gr\u{f6}\u{df}e -- `q' <a|b>";

pub(crate) fn trials() -> Vec<Trial> {
    let is_there = ["pdflatex", "bibtex"].iter().all(|program| Command::new(program).arg("--version").output().is_ok());
    if !is_there {
        eprintln!("LaTeX is not tested: pdflatex or bibtex is missing");
    }
    let may_be_ignored = !is_there && !required();
    let trials = [
        ("a_scheme", "converge tunnel.toml --points 12"),
        ("an_adaptive_method", "converge tunnel.toml --method taylor --points 6"),
        ("a_wide_table", "audit table.csv --scene tunnel.toml"),
        ("a_solver", "diagnose solver --questions 24"),
    ];
    let trials = trials.map(|(what, line)| {
        trial(&format!("the_report_of_{what}_compiles"), move || compiles(line)).with_ignored_flag(may_be_ignored)
    });
    trials.into()
}

fn compiles(line: &str) -> Check {
    let folder = tempfile::tempdir()?;
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("verification/scenes/tunnel.toml");
    fs::copy(scene, folder.path().join("tunnel.toml"))?;
    fs::write(folder.path().join("table.csv"), TABLE)?;
    let solver = include_str!("../../src/cli/templates/peer.py").replace("my solver", NAME);
    fs::write(folder.path().join("solver.py"), solver)?;
    let said = Command::new(env!("CARGO_BIN_EXE_penetrode"))
        .args(line.split(' ').map(|word| if word == "solver" { "python3 solver.py" } else { word }))
        .args(["--out", "report"])
        .current_dir(folder.path())
        .output()?;
    let paper = folder.path().join("report");
    ensure!(paper.is_dir(), "{line}: {}", String::from_utf8_lossy(&said.stderr));
    ensure!(fs::read_to_string(paper.join("table.tex"))?.contains("\\toprule"), "{line}: no table");
    fs::write(paper.join("paper.tex"), PAPER)?;
    let run = |program: &str, arguments: &[&str]| -> Result<String, Failure> {
        let output = Command::new(program).args(arguments).current_dir(&paper).output()?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        ensure!(output.status.success(), "{line}: {program}: {text}");
        Ok(text)
    };
    let pdflatex = ["-interaction=nonstopmode", "-halt-on-error", "paper.tex"];
    run("pdflatex", &pdflatex)?;
    let said = run("bibtex", &["paper"])?;
    ensure!(!said.contains("Warning"), "{line}: {said}");
    run("pdflatex", &pdflatex)?;
    let said = run("pdflatex", &pdflatex)?;
    for word in ["undefined", "Missing", "Overfull \\hbox"] {
        ensure!(!said.contains(word), "{line}: {word} in {said}");
    }
    ensure!(fs::read(paper.join("paper.pdf"))?.starts_with(b"%PDF"), "{line}: no PDF");
    Ok(())
}
