//! Nothing: the benchmarks stand beside this file, `cargo bench --bench NAME` runs one.
