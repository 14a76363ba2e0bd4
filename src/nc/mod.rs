//! NC programs: blocks with spans, lexer and parser, modal interpreter, formatting; one dialect a file. May use: diagnostic, geometry, motion, machine, feed (writing half only).
