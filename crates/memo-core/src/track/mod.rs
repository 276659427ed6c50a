//! Where evidence and model meet: similarity, search, start, filter, tracker.
