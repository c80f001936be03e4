# Daily commands. Install: `cargo install just`, or `pip install rust-just`; `just` alone lists them.
_list:
    @{{ just_executable() }} --list --unsorted

# Simulate, record and analyse the demo.
demo:
    cargo run --release --locked -- run protocols/demo.yaml

# Tests of one crate: `just test analysis`, `just test analysis-tests audit`.
test crate *args:
    cargo test -p skinrig{{ if crate == "cli" { "" } else { "-" + crate } }} {{ args }}

# All tests.
test-all:
    cargo test --workspace --locked

# Formatting, lints and docs, as in `.ci/run`.
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets --features skinrig/evk4,skinrig/tls,skinrig/postgres,skinrig/s3 --locked -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

# Mutation tests of one mutant in `share` of a crate (install: `cargo install cargo-mutants`): `just mutants compare 15`,
# `just mutants analysis 400 --test-package skinrig-analysis --test-package skinrig-analysis-tests`.
mutants crate share *args:
    cargo mutants -p skinrig-{{ crate }} --shard 0/{{ share }} --sharding round-robin --cap-lints=true -o target {{ args }} -- --locked

# Complete check of a clean clone.
ci:
    bash .ci/run

# The nightly suite on the emulated bench.
night out="/tmp/skinrig-nights":
    cargo build --locked -p skinrig -p skinrig-emulated-bench
    target/debug/emulated-bench -- target/debug/skinrig hil run hil/nightly.yaml --rig hil/rigs/emulated.yaml --out {{ out }}

# Regenerate schemas, snapshots of the command line and the table of faults.
generate:
    cargo run -q -p skinrig-protocol --example write_schema
    INSTA_UPDATE=always cargo test -p skinrig --test commands json
    SKINRIG_WRITE_DOCS=1 cargo test -p skinrig-tests faults

# The documentation as a site, with search (needs mdbook).
site:
    mdbook serve docs --open

# A tarball and a .deb for computers without a checkout.
package out="dist":
    packaging/package {{ out }}
