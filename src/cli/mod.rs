//! Command line: arguments, progress, printing, nothing else.
