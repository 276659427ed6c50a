//! The seeded generator of scenes with ground truth that tests, benches and the demo share.
