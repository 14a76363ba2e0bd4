//! The machine file's JSON Schema, for editors. Uses nothing of the crate.

use serde_json::{Value, json};

/// The JSON Schema (2020-12) of a machine file, as indented text.
pub fn schema() -> String {
    format!("{:#}", value())
}

fn value() -> Value {
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "regulus machine file",
        "description": "A machine of three to five axes and its control. Lengths mm, angles degrees, speeds mm/min and degrees/min, \
                        accelerations mm/s^2 and degrees/s^2, jerks mm/s^3 and degrees/s^3.",
        "type": "object",
        "additionalProperties": false,
        "required": ["format", "version", "name", "description", "source", "linear", "control"],
        "properties": {
            "format": { "const": "regulus-machine" },
            "version": { "const": 1 },
            "name": text("Name, as in a job file."),
            "description": text("One line for people."),
            "source": text("Where the numbers come from."),
            "spindle": spindle(),
            "bodies": {
                "type": "array",
                "items": body(),
                "description": "What a tool, a part or a fixture could run into.",
            },
            "linear": {
                "type": "object",
                "additionalProperties": false,
                "required": ["X", "Y", "Z"],
                "properties": { "X": linear(), "Y": linear(), "Z": linear() },
            },
            "rotary": { "type": "array", "maxItems": 2, "items": rotary() },
            "tolerances": tolerances(),
            "control": control(),
        },
    })
}

fn tolerances() -> Value {
    let one = |description: &str| json!({ "type": "number", "minimum": 0, "maximum": 1, "description": description });
    json!({
        "type": "object",
        "description": "How far the machine may be from its own numbers, for `verify --uncertainty`.",
        "additionalProperties": false,
        "properties": {
            "pivot": one("Of each pivot along X, Y and Z, mm; 0 when left out."),
            "direction": one("Of the direction of each rotary axis about X, Y and Z, degrees; 0 when left out."),
            "angle": one("Of the angle at which each rotary axis stands, degrees; 0 when left out."),
        },
    })
}

fn text(description: &str) -> Value {
    json!({ "type": "string", "description": description })
}

fn flag(description: &str) -> Value {
    json!({ "type": "boolean", "description": description })
}

fn positive(description: &str) -> Value {
    json!({ "type": "number", "exclusiveMinimum": 0, "description": description })
}

fn numbers(count: usize, description: &str) -> Value {
    json!({
        "type": "array", "items": { "type": "number" }, "minItems": count, "maxItems": count, "description": description
    })
}

fn lines(description: &str) -> Value {
    json!({ "type": "array", "items": { "type": "string" }, "description": description })
}

fn digits(description: &str) -> Value {
    json!({ "type": "integer", "minimum": 0, "maximum": 9, "description": description })
}

fn rotation() -> Value {
    numbers(3, "Measured: the axis' direction is turned by this about the machine's X, Y and Z, degrees.")
}

fn spindle() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "axis": numbers(3, "From the tip toward the spindle, at rotary zero; [0, 0, 1] when left out."),
            "gauge_point": numbers(3, "Gauge point with every axis at zero, machine frame."),
            "axis_zero": {
                "enum": ["gauge-point", "tip"],
                "description": "What the linear axes count; \"tip\" where the control takes the tool length out of them.",
            },
        },
    })
}

/// A body in the machine frame, with every axis at zero.
fn body() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["name", "moves_with"],
        "properties": {
            "name": text("Name, for findings."),
            "moves_with": {
                "enum": ["base", "X", "Y", "Z", "A", "B", "C", "table", "spindle"],
                "description": "An axis of this machine; base stands still, table carries the part, spindle the tool.",
            },
            "box": {
                "type": "object",
                "additionalProperties": false,
                "description": "min and max, or place and size.",
                "properties": {
                    "min": numbers(3, "Least coordinates, machine frame, every axis at zero."),
                    "max": numbers(3, "Greatest coordinates."),
                    "place": numbers(3, "Least coordinates."),
                    "size": numbers(3, "Lengths along X, Y and Z."),
                },
            },
            "cylinder": {
                "type": "object",
                "additionalProperties": false,
                "required": ["base", "radius", "length"],
                "properties": {
                    "base": numbers(3, "Middle of one end, machine frame, every axis at zero."),
                    "axis": numbers(3, "Way to the other end, of any length; [0, 0, 1] when left out."),
                    "radius": positive("mm."),
                    "length": positive("mm."),
                },
            },
            "file": text("STL file of a closed mesh in mm, relative to the machine file."),
            "near_miss": {
                "type": "number",
                "minimum": 0,
                "description": format!("Distance below which nearness is told, mm; {} when left out.", super::NEAR_MISS),
            },
        },
    })
}

fn linear() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["limits", "speed", "acceleration"],
        "properties": {
            "on": {
                "enum": ["table", "head"],
                "description": "Whether it moves the part or the tool; head when left out. Matters for bodies only.",
            },
            "carried_by": {
                "enum": ["X", "Y", "Z"],
                "description": "The linear axis that this one sits on; X, Y, Z sit on each other in this order when left out.",
            },
            "limits": numbers(2, "[lower, upper], mm."),
            "speed": positive("Top speed, mm/min."),
            "acceleration": positive("Top acceleration, mm/s^2."),
            "jerk": positive("Top jerk, mm/s^3; not limited when left out."),
            "direction": numbers(3, "Way of the tool relative to the table when the axis counts up; its own letter's."),
            "error": {
                "type": "object",
                "additionalProperties": false,
                "required": ["rotation"],
                "properties": { "rotation": rotation() },
            },
        },
    })
}

fn rotary() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["letter", "on", "direction", "pivot", "limits", "speed", "acceleration"],
        "properties": {
            "letter": { "enum": ["A", "B", "C"] },
            "on": { "enum": ["table", "head"], "description": "Whether it turns the part or the tool." },
            "carried_by": {
                "enum": ["A", "B", "C"],
                "description": "The rotary axis that this one sits on, when both are on one side.",
            },
            "direction": numbers(3, "Direction of the axis with every axis at zero; any length."),
            "pivot": numbers(3, "A point of the axis with every axis at zero, machine frame."),
            "sense": {
                "enum": ["iso", "reversed"],
                "description": "iso: a positive word turns the tool right-handed about the direction as seen from the part.",
            },
            "limits": {
                "description": "[lower, upper] in degrees, or how it turns without end.",
                "oneOf": [numbers(2, "[lower, upper], degrees."), { "enum": ["unlimited", "wrapped", "modulo"] }],
            },
            "index_step": {
                "type": "number", "minimum": 0, "exclusiveMaximum": 360,
                "description": "For an axis that turns only while the tool does not cut: degrees between the angles at \
                                which it is clamped, 0 for any angle.",
            },
            "error": {
                "type": "object",
                "additionalProperties": false,
                "properties": {
                    "rotation": rotation(),
                    "shift": numbers(3, "Measured: the pivot lies off by this, mm."),
                },
            },
            "speed": positive("Top speed, degrees/min."),
            "acceleration": positive("Top acceleration, degrees/s^2."),
            "jerk": positive("Top jerk, degrees/s^3; not limited when left out."),
        },
    })
}

fn control() -> Value {
    let fields: Vec<String> =
        super::TEMPLATE_FIELDS.iter().map(|(field, meaning)| format!("{field} ({meaning})")).collect();
    let fields = format!("minijinja; fields: {}.", fields.join("; "));
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["dialect", "work_offsets"],
        "properties": {
            "dialect": { "enum": super::Dialect::ALL.map(|(_, name)| name) },
            "tcp": flag("Whether programs are written with TCP on unless a job says otherwise."),
            "work_offsets": {
                "type": "object",
                "minProperties": 1,
                "additionalProperties": numbers(3, "Part's zero in the machine frame at rotary zero."),
            },
            "reference_positions": {
                "type": "array",
                "items": numbers(5, "X, Y, Z, mm, then the rotary axes in the order of the file, degrees."),
                "description": "Where G28 and G30 bring the axes, in this order; zero when left out.",
            },
            "templates": {
                "type": "object",
                "additionalProperties": false,
                "description": fields,
                "properties": {
                    "header": text("Before everything else."),
                    "retract": text("To a safe place, TCP off; before the tool call and after the path."),
                    "tool_call": text("Tool, work offset, length, spindle."),
                    "approach": text("To where the path begins."),
                    "end": text("Behind the last retract."),
                },
            },
            "options": options(),
        },
    })
}

fn options() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "linear_digits": digits("Decimals of X, Y, Z words."),
            "rotary_digits": digits("Decimals of rotary words."),
            "vector_digits": digits("Decimals of the words of a tool vector."),
            "feed_digits": digits("Decimals of F words."),
            "units": { "enum": ["mm", "inch"], "description": "Units of written programs." },
            "orientation": {
                "enum": ["angles", "vectors"],
                "description": "How written blocks say the tool's orientation with TCP on.",
            },
            "feed_mode": { "enum": ["inverse-time", "per-minute"] },
            "max_feed": positive("Largest F of feed per minute, mm/min."),
            "inverse_time_range": numbers(2, "[smallest, largest] F of inverse-time feed, 1/min."),
            "inverse_time_unit": {
                "enum": ["per-minute", "per-second", "seconds"],
                "description": "What F counts in inverse-time feed.",
            },
            "feed_radius": {
                "type": "number",
                "minimum": 0,
                "description": "mm at which the turn of a rotary axis counts for F per minute, TCP off; 0: not at all.",
            },
            "max_block_rate": positive("Most blocks that the control takes in a second."),
            "max_block_length": { "type": "integer", "minimum": 60, "description": "Characters of a block." },
            "length_codes": {
                "type": "array",
                "items": { "type": "string" },
                "minItems": 2,
                "maxItems": 2,
                "description": "G codes that call a tool's length by its number (H) and end it.",
            },
            "tcp_on": text("Code that turns TCP on; empty where there is none."),
            "tcp_on_vectors": text("Code that turns TCP on for tool vectors, where tcp_on does not."),
            "tcp_off": text("Code that turns TCP off; empty where there is none."),
            "tcp_at_start": flag("Whether TCP is on when a program starts."),
            "tcp_interpolation": {
                "enum": ["rotary-linear", "great-circle"],
                "description": "How the tool axis turns between blocks with angles, TCP on.",
            },
            "vector_interpolation": {
                "enum": ["rotary-linear", "great-circle"],
                "description": "How it turns between blocks with tool vectors.",
            },
            "exact_stop": flag("Whether the control stops at the end of each feed block on G61, G9 or G60."),
            "rounding_rotary_deg": {
                "type": "number",
                "minimum": 0,
                "maximum": 180,
                "description": "How far each rotary axis that turns may leave its way at corners that a program lets the \
                    control round (G64 P), degrees; as far as the program says, else as two blocks laid over each other \
                    bring it, when left out.",
            },
            "cycle": {
                "type": "number",
                "minimum": 0,
                "maximum": 1,
                "description": "Seconds between the places that the control interpolates; 0 where that is not known.",
            },
            "rollover": {
                "enum": ["shortest", "sign", "within"],
                "description": "Which way a wrapped axis turns: the shorter, that of the word's sign, or never past zero.",
            },
            "shortest_way": {
                "enum": ["wrapped", "within-travel"],
                "description": "Which rotary axes turn the shorter way on M126 or DC(): wrapped ones, or any within its travel.",
            },
            "number_without_point": {
                "enum": ["required", "unit", "increment"],
                "description": "What a number without decimal point means; required: such a number is an error.",
            },
            "least_increment": positive("What such a number counts, mm and degrees."),
            "decimal_comma": flag("Whether the decimal sign is a comma in written programs."),
            "tcp_limits_axes": flag("Whether the control keeps the axes' speeds with TCP on."),
            "length_offset_without_tcp": flag("Whether the tool length is part of the Z zero with TCP off."),
            "start_lines": lines("Written after the header."),
            "retract_lines": lines("Written before the first move and after the last, TCP off."),
            "end_lines": lines("Written before the end of the program."),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Machine, builtin};

    /// The keys that the reader says it knows in the table of a line that is replaced by one with an unknown key.
    fn known(line: &str) -> Vec<String> {
        let text = format!("{}\n[control.templates]\n", builtin("xyzac-trt").unwrap()).replacen(
            line,
            &format!("{line}\nbogus = 1\n"),
            1,
        );
        let help = Machine::read("m.toml", &text).unwrap_err().help.unwrap();
        let mut keys: Vec<String> = help.rsplit(": ").next().unwrap().split(", ").map(str::to_owned).collect();
        keys.sort();
        keys
    }

    fn described(path: &str) -> Vec<String> {
        let value = value();
        let table = value.pointer(path).and_then(|v| v.get("properties")).and_then(Value::as_object).unwrap();
        table.keys().cloned().collect()
    }

    /// Where a value does not fit a schema, for what of JSON Schema this schema uses.
    fn misfits(value: &Value, schema: &Value, path: &str, found: &mut Vec<String>) {
        let mut say = |what: &str| found.push(format!("{path}: {what}"));
        if let Some(constant) = schema.get("const").filter(|constant| *constant != value) {
            say(&format!("is not {constant}"));
        }
        if schema.get("enum").and_then(Value::as_array).is_some_and(|allowed| !allowed.contains(value)) {
            say("is none of the words");
        }
        let fits = match schema.get("type").and_then(Value::as_str) {
            Some("object") => value.is_object(),
            Some("array") => value.is_array(),
            Some("string") => value.is_string(),
            Some("boolean") => value.is_boolean(),
            Some("integer") => value.is_i64(),
            Some("number") => value.is_number(),
            _ => true,
        };
        if !fits {
            say("has another type");
        }
        let number = |key: &str| schema.get(key).and_then(Value::as_f64);
        if let Some(given) = value.as_f64() {
            let low = number("minimum").is_some_and(|least| given < least);
            let lower = number("exclusiveMinimum").is_some_and(|least| given <= least);
            if low || lower || number("maximum").is_some_and(|most| given > most) {
                say("is out of range");
            }
        }
        if let Some(one_of) = schema.get("oneOf").and_then(Value::as_array) {
            let fitting = one_of.iter().filter(|schema| {
                let mut found = Vec::new();
                misfits(value, schema, path, &mut found);
                found.is_empty()
            });
            if fitting.count() != 1 {
                say("does not fit exactly one form");
            }
        }
        if let Some(list) = value.as_array() {
            if number("minItems").is_some_and(|n| (list.len() as f64) < n)
                || number("maxItems").is_some_and(|n| list.len() as f64 > n)
            {
                say("has another length");
            }
            for (index, item) in list.iter().enumerate() {
                misfits(item, &schema["items"], &format!("{path}[{index}]"), found);
            }
        }
        let Some(table) = value.as_object() else { return };
        let required = schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
        found.extend(required.filter(|key| !table.contains_key(*key)).map(|key| format!("{path}: no {key}")));
        for (key, item) in table {
            match (schema.get("properties").and_then(|p| p.get(key)), &schema["additionalProperties"]) {
                (Some(schema), _) => misfits(item, schema, &format!("{path}.{key}"), found),
                (None, Value::Bool(false)) => found.push(format!("{path}: {key} is not known")),
                (None, schema) => misfits(item, schema, &format!("{path}.{key}"), found),
            }
        }
    }

    #[test]
    fn machines_that_come_along_fit_the_schema() {
        for (name, text) in crate::machine::BUILTIN {
            let machine: Value = toml::from_str(text).unwrap();
            let mut found = Vec::new();
            misfits(&machine, &value(), name, &mut found);
            assert!(found.is_empty(), "{found:?}");
        }
        let broken = builtin("tr-35").unwrap().replace("on = \"head\"", "on = \"heat\"").replace("[0, 0, 1]", "[0, 1]");
        let mut found = Vec::new();
        misfits(&toml::from_str(&broken).unwrap(), &value(), "", &mut found);
        assert_eq!(found.len(), 3, "{found:?}");
    }

    #[test]
    fn schema_has_the_keys_that_the_reader_knows() {
        assert_eq!(known("version = 1"), described(""));
        assert_eq!(known("[linear.X]"), described("/properties/linear/properties/X"));
        assert_eq!(known("[[rotary]]"), described("/properties/rotary/items"));
        assert_eq!(known("[[bodies]]"), described("/properties/bodies/items"));
        assert_eq!(known("[control]"), described("/properties/control"));
        assert_eq!(known("[control.templates]"), described("/properties/control/properties/templates"));
        assert_eq!(known("[control.options]"), described("/properties/control/properties/options"));
    }
}
