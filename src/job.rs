//! The job file: raw serde structs, then validated types.
