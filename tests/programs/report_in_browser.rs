//! The reports of the suite, of the stress cases, of costs and of a user's code in headless Chromium: each loads without a message, asks for nothing, and fits a phone and a desk.
//!
//! Where Chromium is missing, the tests say so in one line and count as ignored; with `CI=true` they fail, so that a
//! build server cannot quietly check nothing.

use std::env;
use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use libtest_mimic::Trial;
use penetrode::report::stress::files;
use penetrode::report::{Environment, Run, folder};
use penetrode::studies::extreme_scenes;
use penetrode::suite::checks::PeerAnswers;
use penetrode::suite::{Inputs, Program, Suite};
use serde_json::Value;

use crate::trials::{Check, Failure, ensure, required, trial};

/// Time that one page may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// What every run of the browser is given.
const FLAGS: &str = "--headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update \
                     --disable-default-apps --disable-extensions --disable-sync --no-first-run --no-pings \
                     --hide-scrollbars --virtual-time-budget=10000";

/// Width of what is printed on a page of A4 (px).
const PAPER: u32 = 680;

/// Height of the letters of drawings, at least (px): 8 pt on paper.
const LETTERS: f64 = 8.0 / 0.75;

/// Folders of the pages: the report of the suite, that of the stress cases, that of costs, and those of a user's code.
const PAGES: [&str; 8] =
    ["report", "stress", "costs", "scheme", "good-table", "bad-table", "good-solver", "faulty-solver"];

/// The commands that write the last of them; `SCENES/` is the folder of the shipped scenes.
const STUDIES: [(&str, &str); 6] = [
    ("costs", "bench SCENES/tunnel.toml --parts work-precision,step-size,scaling --most 10 --repeats 1"),
    ("scheme", "converge SCENES/tunnel.toml --points 30"),
    ("good-table", "audit good.csv --scene SCENES/perforate.toml"),
    ("bad-table", "audit bad.csv --scene SCENES/tunnel.toml"),
    ("good-solver", "diagnose 'python3 peer.py'"),
    ("faulty-solver", "diagnose 'python3 faulty.py'"),
];

/// Rows of the lagged scheme, with a column that no scene knows.
const GOOD: &str = "dt_s,time_s,velocity_m_s,peak_force_kn\n4e-6,6.284666391876777e-4,134.60298957430106,810.32\n\
                    2e-6,6.2828134204179e-4,134.80502593865666,810.08\n1e-6,6.281868603759894e-4,134.90686342544095,810.02\n\
                    5e-7,6.281391621356539e-4,134.95798652400637,810.005\n";

/// Scatter, a wrong limit, and what is no number.
const BAD: &str = "dt_s,depth_m,velocity_m_s,a_column_with_quite_a_long_name\n4e-6,0.1461,136,1\n2e-6,0.1452,135.5,2\n\
                   1e-6,0.1461,135.25,4\n5e-7,0.1449,135.125,nan\n";

/// Figures that a report must have, by their names.
const FIGURES: [(&str, &str); 8] = [
    (
        "report",
        "flights approach-with-n observed-orders energy-residual peer-differences stability-map rounding-floor \
         critical-energy critical-energy-difference applicability-map measured-depths layers-layered",
    ),
    ("stress", "stability-map rounding-floor stiffness"),
    ("costs", "cost-tunnel steps-tunnel-depth growth"),
    ("scheme", "error values"),
    ("good-table", "error values"),
    ("bad-table", "error values"),
    ("good-solver", "right-by-content errors-by-question"),
    ("faulty-solver", "right-by-content errors-by-question"),
];

/// A claim and how it is checked.
type Claim = (&'static str, fn(&Stage) -> Check);

const CLAIMS: [Claim; 8] = [
    ("the_page_loads_without_a_word_on_the_console", is_silent),
    ("a_page_that_errs_is_heard", hears_a_planted_error),
    ("no_request_leaves_the_page", asks_for_nothing),
    ("a_page_that_asks_is_caught", catches_a_planted_request),
    ("nothing_overflows_a_phone_or_a_desk", fits),
    ("headings_images_and_colours_are_accessible", is_accessible),
    ("every_figure_has_its_place_its_files_and_words", has_its_figures),
    ("it_prints", prints),
];

pub(crate) fn trials() -> Vec<Trial> {
    let is_there = browser().is_some();
    if !is_there {
        eprintln!("reports are not looked at in a browser: Chromium is missing");
    }
    let may_be_ignored = !is_there && !required();
    // The reports are written for the first that asks; a test that never runs costs nothing.
    let stage = Arc::new(OnceLock::new());
    let trial = |(name, check): Claim| {
        let stage = Arc::clone(&stage);
        let shown = move || {
            let stage: &Result<Stage, String> = stage.get_or_init(|| Stage::new().map_err(|error| error.to_string()));
            check(stage.as_ref().map_err(String::as_str)?)
        };
        trial(name, shown).with_ignored_flag(may_be_ignored)
    };
    CLAIMS.map(trial).into()
}

/// A report, and the browser that shows it.
struct Stage {
    browser: PathBuf,
    folder: tempfile::TempDir,
}

impl Stage {
    fn new() -> Result<Self, Failure> {
        let browser = browser().ok_or("Chromium is not installed")?;
        let mut suite = Suite::embedded()?;
        // Every kind of section and figure; the whole suite would add length, not kinds.
        let starts = "order/drag order/jump small-impact invariant peer closed-form self-convergence events stab rounding sweep map measured \
                      layers command/slopes command/experiments";
        suite.claims.retain(|claim| starts.split(' ').any(|start| claim.id.starts_with(start)));
        let program = Program::new(Path::new(env!("CARGO_BIN_EXE_penetrode")))?;
        let inputs = Inputs { seed: 1, peers: &PeerAnswers::recorded()?, program: Some(&program), points: &[] };
        let judged = suite.run(inputs, &|_| ());
        let environment = Environment::here(1, "penetrode verify --seed 1".to_owned(), &suite, Vec::new());
        let folder = tempfile::tempdir()?;
        let run = Run { suite: &suite, judged: &judged, environment, points: &[(5.0, 30.0)], random: None };
        folder::write(folder::files(&run), &folder.path().join(PAGES[0]))?;
        let suite = Suite::edges()?;
        let judged = suite.run(Inputs { seed: 1, peers: &PeerAnswers::default(), program: None, points: &[] }, &|_| ());
        let summary = extreme_scenes::run(200, 1, &|| ());
        let environment = Environment::here(1, "penetrode stress --seed 1".to_owned(), &suite, Vec::new());
        let run = Run { suite: &suite, judged: &judged, environment, points: &[], random: Some((&summary, 1.0)) };
        folder::write(files(&run), &folder.path().join(PAGES[1]))?;
        write_studies(folder.path())?;
        Ok(Self { browser, folder })
    }

    /// The page in `folder`, one of [`PAGES`].
    fn page(&self, folder: &str) -> PathBuf {
        self.folder.path().join(folder).join("report.html")
    }

    /// A copy of the page in `folder`, without its policy and with `inserted` before its end.
    fn altered(&self, folder: &str, name: &str, inserted: &str) -> Result<PathBuf, Failure> {
        let page = fs::read_to_string(self.page(folder))?;
        let start = page.find("<meta http-equiv=\"Content-Security-Policy\"").ok_or("the page has no policy")?;
        let end = start + page[start..].find('>').ok_or("the policy has no end")? + 1;
        let altered = format!("{}{}", &page[..start], &page[end..]).replace("</body>", &format!("{inserted}</body>"));
        let path = self.folder.path().join(folder).join(name);
        fs::write(&path, altered)?;
        Ok(path)
    }

    /// Runs the browser on `page`; ends it when it takes too long.
    fn show(&self, page: &Path, arguments: &[&str]) -> Result<Output, Failure> {
        let profile = tempfile::tempdir()?;
        let mut child = Command::new(&self.browser)
            .args(FLAGS.split(' '))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(arguments)
            .arg(format!("file://{}", page.display()))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        // Both pipes are emptied while it runs, or a long page would fill them and wait for ever.
        let stdout = all_of(child.stdout.take().ok_or("no pipe")?);
        let stderr = all_of(child.stderr.take().ok_or("no pipe")?);
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if started.elapsed() > PATIENCE {
                child.kill()?;
                child.wait()?;
                return Err(format!("the browser was still busy after {PATIENCE:?}").into());
            }
            thread::sleep(Duration::from_millis(20));
        };
        let [stdout, stderr] = [stdout, stderr].map(|reader| reader.join().map_err(|_| "reader died"));
        Ok(Output { status, stdout: stdout??, stderr: stderr?? })
    }

    /// What the console said.
    fn console(&self, page: &Path) -> Result<Vec<String>, Failure> {
        let output = self.show(page, &["--enable-logging=stderr", "--dump-dom"])?;
        ensure!(
            !(!output.status.success() || !String::from_utf8_lossy(&output.stdout).contains("</html>")),
            "the browser failed: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let stderr = String::from_utf8_lossy(&output.stderr);
        Ok(stderr.lines().filter(|line| line.contains(":CONSOLE")).map(str::to_owned).collect())
    }

    /// What was asked for over the network: all of it goes to a proxy that listens here and gives nothing.
    ///
    /// What the browser asks its maker of its own accord, whatever the page, is left out.
    fn requests(&self, page: &Path) -> Result<Vec<String>, Failure> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let proxy = format!("--proxy-server=http://{}", listener.local_addr()?);
        let done = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&done);
        listener.set_nonblocking(true)?;
        let listening = thread::spawn(move || {
            let mut asked = Vec::new();
            loop {
                // Read before the queue is emptied once more: what came before the end is heard.
                let last = seen.load(Ordering::SeqCst);
                while let Ok((stream, _)) = listener.accept() {
                    asked.extend(refuse(stream));
                }
                if last {
                    return asked;
                }
                thread::sleep(Duration::from_millis(5));
            }
        });
        let shown = self.show(page, &[&proxy, "--dump-dom"]);
        done.store(true, Ordering::SeqCst);
        let mut asked = listening.join().map_err(|_| "the proxy died")?;
        shown?;
        asked.retain(|line| {
            let address = line.split(' ').nth(1).unwrap_or_default();
            let host = address.rsplit("://").next().unwrap_or_default().split(['/', ':']).next().unwrap_or_default();
            !["google.com", "googleapis.com", "gstatic.com", "gvt1.com"].iter().any(|maker| host.ends_with(maker))
        });
        Ok(asked)
    }

    /// What [`MEASURE`] finds in the page when it is `width` wide, that of [`PAPER`] with the rules of print.
    fn measure(&self, folder: &str, width: u32, dark: bool) -> Result<Value, Failure> {
        let inner = self.altered(folder, &format!("measured-{width}-{dark}.html"), MEASURE)?;
        if width == PAPER {
            let page = fs::read_to_string(&inner)?;
            fs::write(&inner, page.replace("@media print", "@media all").replace("@media screen", "@media print"))?;
        }
        let name = inner.file_name().ok_or("no name")?.to_string_lossy().into_owned();
        // A window cannot be as narrow as a phone; a frame can.
        let outer = self.folder.path().join(folder).join(format!("frame-{width}-{dark}.html"));
        fs::write(
            &outer,
            format!(
                "<!doctype html><meta name=color-scheme content='light dark'><iframe src=\"{name}\" \
                 style=\"width:{width}px;height:800px;border:0\"></iframe><pre id=out></pre><script>\
                 addEventListener('message',e=>{{document.getElementById('out').textContent='FOUND'+e.data+'END'}})\
                 </script>"
            ),
        )?;
        let scheme = format!("--blink-settings=preferredColorScheme={}", i32::from(!dark));
        let output = self.show(&outer, &["--window-size=1600,900", &scheme, "--dump-dom"])?;
        let dom = String::from_utf8_lossy(&output.stdout).into_owned();
        let found = dom.split_once(">FOUND").and_then(|(_, rest)| rest.split_once("END")).map(|(found, _)| found);
        let found = found.ok_or_else(|| format!("nothing was measured: {dom:.500}"))?;
        Ok(serde_json::from_str(&found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))?)
    }
}

/// Writes the reports of a user's code to `folder`.
fn write_studies(folder: &Path) -> Check {
    let solver = include_str!("../../src/cli/templates/peer.py");
    let faulty = solver.replace("(r + q * v) * v)", "(r + 0.5 * q * v) * v)");
    ensure!(faulty != solver, "there is no drag to halve");
    for (name, text) in [("good.csv", GOOD), ("bad.csv", BAD), ("peer.py", solver), ("faulty.py", faulty.as_str())] {
        fs::write(folder.join(name), text)?;
    }
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/verification/scenes/");
    for (name, line) in STUDIES {
        let words = shlex::split(&line.replace("SCENES/", scenes)).ok_or("an open quote")?;
        let run = Command::new(env!("CARGO_BIN_EXE_penetrode"))
            .args(words)
            .args(["--out", name])
            .current_dir(folder)
            .output()?;
        ensure!(folder.join(name).is_dir(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    }
    Ok(())
}

/// Measures the page that it stands in, everything unfolded, and tells its frame.
const MEASURE: &str = include_str!("measure.html");

/// Reads a pipe to its end, on a thread of its own.
fn all_of(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<std::io::Result<Vec<u8>>> {
    thread::spawn(move || {
        let mut text = Vec::new();
        pipe.read_to_end(&mut text).map(|_| text)
    })
}

/// First line of a request, which is refused.
fn refuse(mut stream: TcpStream) -> Option<String> {
    stream.set_nonblocking(false).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(1))).ok()?;
    let mut head = [0; 512];
    let length = stream.read(&mut head).ok()?;
    let _ = stream.write_all(b"HTTP/1.1 502 Bad Gateway\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    String::from_utf8_lossy(&head[..length]).lines().next().map(str::to_owned)
}

/// Chromium or Chrome, from the search path or `CHROMIUM`.
fn browser() -> Option<PathBuf> {
    let named = env::var_os("CHROMIUM").map(PathBuf::from).filter(|path| path.is_file());
    let path = env::var_os("PATH").unwrap_or_default();
    named.or_else(|| {
        ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
            .iter()
            .flat_map(|name| env::split_paths(&path).map(move |folder| folder.join(name)))
            .find(|candidate| candidate.is_file())
    })
}

fn is_silent(stage: &Stage) -> Check {
    for folder in PAGES {
        let said = stage.console(&stage.page(folder))?;
        ensure!(said.is_empty(), "{folder}: {}", said.join("\n"));
    }
    Ok(())
}

/// Without this, a browser that writes its messages elsewhere would let everything pass.
fn hears_a_planted_error(stage: &Stage) -> Check {
    let page = stage.altered(PAGES[0], "errs.html", "<script>console.error('planted')</script>")?;
    let said = stage.console(&page)?;
    ensure!(said.iter().any(|line| line.contains("planted")), "heard only {said:?}");
    Ok(())
}

fn asks_for_nothing(stage: &Stage) -> Check {
    for folder in PAGES {
        let asked = stage.requests(&stage.page(folder))?;
        ensure!(asked.is_empty(), "{folder}: {}", asked.join("\n"));
        // And there is nothing in it that could ask, whatever the policy says.
        let page = fs::read_to_string(stage.page(folder))?.replace("href=\"https://doi.org/", "");
        for word in
            ["<script", "<img", "<link rel=\"stylesheet", " src=", "url(", "@import", "href=\"http", "href=\"//"]
        {
            ensure!(!page.contains(word), "{folder}: the page contains {word}");
        }
    }
    Ok(())
}

fn catches_a_planted_request(stage: &Stage) -> Check {
    let page = stage.altered(PAGES[0], "asks.html", "<img src=\"http://planted.invalid/picture\" alt=\"\">")?;
    let asked = stage.requests(&page)?;
    ensure!(asked.iter().any(|line| line.contains("planted.invalid")), "caught only {asked:?}");
    Ok(())
}

fn fits(stage: &Stage) -> Check {
    for (folder, figures) in FIGURES {
        // From 1121 px on rows are no longer cards.
        for width in [390, PAPER, 768, 1121, 1440] {
            let found = stage.measure(folder, width, false)?;
            ensure!(found["width"] == width, "measured at {} and not at {width}", found["width"]);
            // What stays folded on paper may be wider; whatever else is would shrink every page.
            for key in ["folded", "unfolded"].into_iter().take(if width == PAPER { 1 } else { 2 }) {
                ensure!(
                    found[key].as_u64().is_some_and(|extent| extent <= u64::from(width)),
                    "{folder}, {width} px: {key} the page is {} px wide: {}",
                    found[key],
                    found["beyond"]
                );
            }
            for key in ["beyond", "texts", "gaps"].into_iter().skip(usize::from(width == PAPER)) {
                ensure!(found[key] == Value::Array(Vec::new()), "{folder}, {width} px: {key}: {}", found[key]);
            }
            let letters = found["letters"].as_f64().unwrap_or_default();
            ensure!(letters >= LETTERS, "{folder}, {width} px: the letters of a drawing have {letters} px");
            let enough = found["figures"].as_u64() >= Some(figures.split(' ').count() as u64);
            ensure!(
                enough && found["svgs"].as_u64() >= found["figures"].as_u64(),
                "{folder}: {} figures of {} drawings",
                found["figures"],
                found["svgs"]
            );
        }
    }
    Ok(())
}

fn is_accessible(stage: &Stage) -> Check {
    for folder in PAGES {
        let mut backgrounds = Vec::new();
        for dark in [false, true] {
            let found = stage.measure(folder, 1440, dark)?;
            for key in ["faint", "headings", "twice", "unnamed", "dead"] {
                ensure!(found[key] == Value::Array(Vec::new()), "{folder}, dark {dark}: {key}: {}", found[key]);
            }
            ensure!(found["h1"] == 1, "{folder}: {} main headings", found["h1"]);
            backgrounds.push(found["background"].to_string());
        }
        ensure!(backgrounds[0] != backgrounds[1], "{folder}: {backgrounds:?}: nothing was dark");
    }
    Ok(())
}

/// Each figure stands in the page once, with its numbers and its drawing beside it, and none is there besides.
fn has_its_figures(stage: &Stage) -> Check {
    for (folder, figures) in FIGURES {
        let page = fs::read_to_string(stage.page(folder))?;
        for name in figures.split(' ') {
            if page.matches(&format!("<figure id=\"figure-{name}\">")).count() != 1 {
                return Err(format!("{folder}: {name} is not there once").into());
            }
        }
        for part in page.split("<figure id=\"figure-").skip(1) {
            let name = part.split('"').next().unwrap_or_default();
            for file in [format!("tables/{name}.csv"), format!("figures/{name}.svg")] {
                let linked = part.contains(&format!("href=\"{file}\""));
                ensure!(
                    !(!linked || !stage.folder.path().join(folder).join(&file).is_file()),
                    "{folder}: {file} is not there"
                );
            }
        }
    }
    let page = fs::read_to_string(stage.page(PAGES[0]))?;
    for words in [
        "Why the simulation lies above Eq. 15",
        "tends to 1.24",
        "N = 38.58",
        "not given",
        "What these data validate, and what not",
        "Through 3 layers the force jumps",
        "Elasticities beside slopes between scenes",
    ] {
        ensure!(page.contains(words), "the report does not say: {words}");
    }
    Ok(())
}

fn prints(stage: &Stage) -> Check {
    for folder in PAGES {
        let file = stage.folder.path().join(format!("{folder}.pdf"));
        stage.show(&stage.page(folder), &[&format!("--print-to-pdf={}", file.display()), "--no-pdf-header-footer"])?;
        let bytes = fs::read(&file)?;
        ensure!(bytes.starts_with(b"%PDF") && bytes.len() >= 50_000, "{folder}: {} bytes of PDF", bytes.len());
    }
    Ok(())
}
