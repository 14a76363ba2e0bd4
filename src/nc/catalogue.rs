//! Every rule that a program is checked by: its stable code and name, what it weighs, why it matters, what to do. Uses
//! nothing of the crate.
//!
//! Codes are grouped by their first digit, see [`GROUPS`]; a code once given is never given to another rule.

/// What a group of rules is about, by the first digit of their codes.
pub const GROUPS: [(char, &str); 8] = [
    ('1', "text and syntax"),
    ('2', "modal state and codes"),
    ('3', "tool, spindle and offsets"),
    ('4', "motion"),
    ('5', "limits of the axes"),
    ('6', "feed and time"),
    ('7', "the part"),
    ('8', "the stock"),
];

/// What a finding weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// What the control does is not what is followed here, or it refuses: no verdict can rest on the program.
    Doubt,
    /// The motion is certain, and the program is not to be run.
    Fault,
    /// To know; the verdict does not change.
    Notice,
}

impl Weight {
    /// Stable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Doubt => "doubt",
            Self::Fault => "fault",
            Self::Notice => "notice",
        }
    }
}

/// A rule of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule {
    /// Stable code, `R` and three digits, the first of which is the group.
    pub id: &'static str,
    /// Stable name.
    pub name: &'static str,
    /// What it weighs, unless the place where it is found says otherwise.
    pub weight: Weight,
    /// What is found, and why it matters.
    pub explanation: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// Makes the enumeration, the list of all, and the catalogue of one table.
macro_rules! catalogue {
    ($($code:ident $id:literal $name:literal $weight:ident, $explanation:literal, $remedy:literal;)*) => {
        /// Which rule a finding is about; code and name are stable.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum FindingCode {
            $(#[doc = $explanation] $code,)*
        }

        impl FindingCode {
            /// All, in the order of their codes.
            pub const ALL: &[Self] = &[$(Self::$code,)*];

            /// What the catalogue says.
            pub fn rule(self) -> &'static Rule {
                match self {
                    $(Self::$code => &Rule {
                        id: $id,
                        name: $name,
                        weight: Weight::$weight,
                        explanation: $explanation,
                        remedy: $remedy,
                    },)*
                }
            }
        }
    };
}

catalogue! {
    UnreadableText "R101" "unreadable-text" Doubt,
        "Text that is no word of the dialect: the control stops there, or reads something else.",
        "Write it as the control's manual says, or check that the machine file names the right dialect.";
    BadComment "R102" "bad-comment" Doubt,
        "A comment that is nested or not closed: what follows may be read as words, or words as comment.",
        "Close the comment on its line, and write no parenthesis inside it.";
    BlockTooLong "R103" "block-too-long" Fault,
        "A block has more characters than the control takes.",
        "Split the block.";
    BadNumber "R104" "bad-number" Doubt,
        "A number that the word cannot carry.",
        "Write a number in the word's range, whole where the word counts.";
    MissingPoint "R105" "missing-point" Doubt,
        "A coordinate without decimal point on a control that may count increments: X10 is then 0.01 mm.",
        "Write the decimal point in every coordinate.";
    RepeatedWord "R106" "repeated-word" Doubt,
        "A letter twice in one block: controls take the last, the first, or refuse.",
        "Write each letter once.";
    UnusedWord "R107" "unused-word" Doubt,
        "A word that no code of its block takes.",
        "Remove it, or add the code that it belongs to.";
    MissingEnd "R108" "missing-end" Fault,
        "The program does not say where it ends: it may have been cut off on its way to the machine.",
        "End it with M2 or M30, and load it again whole.";
    UnreachedText "R109" "unreached-text" Notice,
        "Blocks behind the end of the program, which the control never reaches.",
        "Remove them, or move the end behind them.";
    BlockDelete "R110" "block-delete" Notice,
        "Blocks with block delete; they are taken as executed.",
        "Remove them, or keep block delete off.";
    UnknownCode "R201" "unknown-code" Doubt,
        "A G or M code that the dialect does not know.",
        "Remove it, or check the machine's dialect and its options.";
    UnsupportedCode "R202" "unsupported-code" Doubt,
        "A code that the control knows, whose effect on the motion is not followed.",
        "Post the program without it.";
    GroupConflict "R203" "group-conflict" Doubt,
        "Codes that exclude each other in one block.",
        "Write one of them, or two blocks.";
    NoMotionCode "R204" "no-motion-code" Doubt,
        "Axis words with no motion code in force: the control moves as it did last, or not at all.",
        "Write G0 or G1 before the first axis word.";
    BadArc "R205" "bad-arc" Doubt,
        "An arc that its words do not determine, or whose ends do not fit its centre.",
        "Write the centre or the radius, and both ends at one distance from the centre.";
    Blending "R206" "blending" Notice,
        "The control rounds corners: the tool leaves the programmed path by up to its tolerance.",
        "Write exact path control, or a tolerance well below that of the part.";
    UnitsChange "R207" "units-change" Notice,
        "The unit of length changes after the first move: one of both parts is probably meant otherwise.",
        "Write one unit of length in the header, and keep to it.";
    UnitsSuspected "R208" "units-suspected" Fault,
        "The moves fit the part when their lengths are taken in the other unit: inch and millimetre are confused.",
        "Write the code of the unit that the numbers are in.";
    OtherTool "R301" "other-tool" Fault,
        "The tool put into the spindle is not the job's; the job's is followed.",
        "Call the job's tool, or give the job this tool.";
    MissingOffsetNumber "R302" "missing-offset-number" Doubt,
        "A tool length offset is called without its number.",
        "Write H and the number of the offset.";
    TcpWithoutLength "R303" "tcp-without-length" Fault,
        "TCP is on and no tool length offset is in force: the control takes the gauge point for the tip.",
        "Call the tool length offset before TCP is switched on.";
    UnknownWorkOffset "R304" "unknown-work-offset" Doubt,
        "A work offset that the machine file does not give: nobody knows where the part is.",
        "Give it in the machine file, or use one that is there.";
    OtherWorkOffset "R305" "other-work-offset" Notice,
        "A work offset other than the job's is called; it is followed with the machine file's values.",
        "Call the job's work offset, or correct the job.";
    NoWorkOffset "R306" "no-work-offset" Notice,
        "The program moves before it calls a work offset: the one left over from the last program is in force.",
        "Call the work offset in the header.";
    SpindleOff "R307" "spindle-off" Fault,
        "A feed move while the spindle stands still.",
        "Start the spindle first: S and M3 or M4.";
    NoTool "R308" "no-tool" Notice,
        "The program moves at a feed and calls no tool: the one left over from the last program is in the spindle.",
        "Call the tool in the header.";
    LengthOff "R309" "length-off" Notice,
        "A feed move with TCP off and no tool length offset in force: Z counts from the gauge line, not from the tip.",
        "Call the tool length offset before the first feed move.";
    OtherLength "R310" "other-length" Fault,
        "A tool length offset is called that is not the job's: the tip stands higher or lower by the difference of both.",
        "Call the number of the job's tool, or give --length-offset where the table holds its length under another.";
    MissingAxis "R401" "missing-axis" Doubt,
        "A word for an axis that the machine lacks; where another rotary axis is never named, letters may be confused.",
        "Post for this machine, or check that the machine file is the right one.";
    UnknownStart "R402" "unknown-start" Doubt,
        "A feed move before the program has said where each axis stands.",
        "Position every axis with G0 first.";
    UnreachableAxis "R403" "unreachable-axis" Doubt,
        "A tool axis that the machine's rotary axes cannot make.",
        "Post for this machine, or check that the machine file is the right one.";
    Jump "R404" "jump" Doubt,
        "The tool length or TCP changes while tilted, so that the machine jumps.",
        "Switch where the rotary axes stand at zero, or with the tool clear of the part.";
    WrongTcpState "R405" "wrong-tcp-state" Doubt,
        "A code in a state of TCP in which the control refuses it or does something else.",
        "Switch TCP off, or on, first.";
    RadiansSuspected "R406" "radians-suspected" Doubt,
        "Rotary words that look like radians.",
        "Write rotary words in degrees.";
    Unwinding "R407" "unwinding" Fault,
        "A rotary axis turns by more than half a turn in one feed block, unlike its neighbours: it unwinds in the cut.",
        "Write an angle near the one before, or leave the part and unwind in a rapid.";
    WildMove "R408" "wild-move" Notice,
        "A block leads far from the way of its neighbours, and the next one back: a sign, a digit or a point may be wrong. An error where the part fails.",
        "Check the block's coordinates against those before and after it.";
    TcpSwitchedInCut "R409" "tcp-switched-in-cut" Notice,
        "TCP is switched between two feed moves: the words of both mean different places.",
        "Switch TCP with the tool clear of the part.";
    CutWithoutTcp "R410" "cut-without-tcp" Notice,
        "The machine is set up for TCP, and the program turns rotary axes at a feed with TCP off.",
        "Switch TCP on, or say in the job or the machine file that the program does without: tcp = false.";
    SwappedAxes "R411" "swapped-axes" Fault,
        "The moves fit the part when rotary letters are exchanged, or an axis turns the other way.",
        "Post for this machine; check letters and sense of the rotary axes in the machine file.";
    AbsurdMove "R412" "absurd-move" Doubt,
        "A block leads a kilometre away, or turns an axis a hundred times: a decimal point is lost. It is not followed.",
        "Write the point where it belongs.";
    Travel "R501" "travel-limit" Fault,
        "An axis would have to go beyond the end of its travel.",
        "Place the part otherwise, or post with another branch of the rotary axes.";
    Speed "R502" "speed-limit" Fault,
        "An axis would have to move faster than it can.",
        "Slow the block.";
    Acceleration "R503" "acceleration-limit" Fault,
        "An axis would have to accelerate more than it can.",
        "Slow the block and its neighbours, or smooth the path.";
    Jerk "R504" "jerk-limit" Fault,
        "An axis would have to change its acceleration faster than it can.",
        "Slow the block and its neighbours, or smooth the path.";
    MissingFeed "R601" "missing-feed" Doubt,
        "A feed move without a feed in force; under inverse time every block needs its own.",
        "Write F.";
    FeedTrap "R602" "feed-trap" Notice,
        "A feed that the control does not keep: it clamps or reinterprets the word.",
        "Write a feed in the control's range, or merge short blocks.";
    Starvation "R603" "block-rate" Notice,
        "Blocks follow each other faster than the control reads them: it slows down or stops in the cut.",
        "Post with fewer blocks, a larger linearization, or less feed.";
    NoCut "R604" "no-cut" Fault,
        "The program makes no move at feed.",
        "Give the program that cuts.";
    Overcut "R701" "overcut" Fault,
        "Material is removed below the part's surface, deeper than allowed.",
        "Correct the block, or plan again; the worst place is named.";
    Undercut "R702" "undercut" Fault,
        "Material is left above the part's surface, higher than allowed.",
        "Correct the blocks near it, or plan again; the worst place is named.";
    Uncut "R703" "uncut" Fault,
        "No pass comes near a share of the part.",
        "Add passes, or check work offset, tool length and units.";
    RapidInPart "R704" "rapid-in-part" Fault,
        "A rapid move goes through material.",
        "Retract further before the rapid, or move at a feed.";
    Collision "R705" "collision" Fault,
        "The tool or a body of the machine is where it must not be: shank or holder in the part, any of it in another body.",
        "Use a longer or slimmer tool, tilt it otherwise, retract further, or mount part and fixtures otherwise.";
    NearMiss "R706" "near-miss" Notice,
        "Two bodies come nearer to each other than near_miss of either allows.",
        "Retract further, or mount part and fixtures otherwise; near_miss in machine file and job says what is near.";
    RapidInStock "R801" "rapid-in-stock" Fault,
        "A rapid move goes through material that is still there.",
        "Retract further before the rapid, move at a feed, or take the material away first.";
    BodyInStock "R802" "body-in-stock" Fault,
        "The shank or the holder goes through material that is still there.",
        "Use a longer or slimmer tool, cut less deep at once, or tilt the tool otherwise.";
    FeedInStock "R803" "feed-in-stock" Fault,
        "A move through material is faster than the job's limit.",
        "Slow the block, or raise feed_limit of the job's stock.";
    RemovalRate "R804" "removal-rate" Fault,
        "More material is removed in a time than the job's limit.",
        "Slow the block, cut less deep, or raise removal_limit of the job's stock.";
    Engagement "R805" "engagement" Fault,
        "The flutes are in material over a wider angle than the job's limit.",
        "Step over less, cut trochoidally, or raise engagement_limit_deg of the job's stock.";
}

impl FindingCode {
    /// Stable name for files and filters.
    pub fn name(self) -> &'static str {
        self.rule().name
    }

    /// Stable code for files and filters.
    pub fn id(self) -> &'static str {
        self.rule().id
    }

    /// Finds a rule by its code or its name, in any case.
    pub fn find(text: &str) -> Option<Self> {
        let is = |code: &&Self| code.id().eq_ignore_ascii_case(text) || code.name().eq_ignore_ascii_case(text);
        Self::ALL.iter().find(is).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn codes_and_names_are_unique_ordered_and_found() {
        let ids: Vec<&str> = FindingCode::ALL.iter().map(|code| code.id()).collect();
        assert!(ids.is_sorted() && ids.iter().all(|id| id.len() == 4 && id.starts_with('R')), "{ids:?}");
        let names: BTreeSet<&str> = FindingCode::ALL.iter().map(|code| code.name()).collect();
        assert_eq!((names.len(), ids.iter().collect::<BTreeSet<_>>().len()), (ids.len(), ids.len()));
        for code in FindingCode::ALL {
            assert_eq!(FindingCode::find(code.id()), Some(*code));
            assert_eq!(FindingCode::find(&code.name().to_uppercase()), Some(*code));
            let group = code.id().chars().nth(1).unwrap();
            assert!(GROUPS.iter().any(|(digit, _)| *digit == group), "{code:?}");
        }
        assert_eq!(FindingCode::find("R999"), None);
    }

    #[test]
    fn explanations_and_remedies_are_sentences() {
        for rule in FindingCode::ALL.iter().map(|code| code.rule()) {
            for text in [rule.explanation, rule.remedy] {
                assert!(text.ends_with('.') && text.starts_with(char::is_uppercase), "{}: {text}", rule.id);
            }
        }
    }
}
