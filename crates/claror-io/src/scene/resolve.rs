//! References → objects; cycles are found here, so that everything after this may recurse.

use super::description::{Description, ObjectIndex, Value};
use super::nearest::hint;
use super::source::Log;
use super::values::short;

/// Deepest chain of objects in objects: bounds the recursion of what follows.
const MAX_NESTING: usize = 100;

/// Replaces every reference by the object that it means.
pub(super) fn resolve(description: &mut Description, log: &Log) {
    let Description { objects, ids } = description;
    for object in objects.iter_mut() {
        for property in &mut object.properties {
            let Value::Reference(id) = &property.value else { continue };
            property.value = if let Some(index) = ids.get(id.as_str()) {
                Value::Object(*index)
            } else {
                let message = format!("no object has the id \"{}\"", short(id));
                log.error(property.span, message, hint(id, ids.keys().map(String::as_str)));
                Value::Broken
            };
        }
    }
    break_cycles(description, log);
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    New,
    /// On the path from the root to the object that is being looked at.
    Open,
    /// Free of cycles, with the length of the longest chain below.
    Done(usize),
}

/// One step of the walk: an object and the property that comes next.
struct Step {
    object: ObjectIndex,
    next: usize,
    depth: usize,
}

/// Walks all objects depth first, without recursion, and cuts what leads back or too deep.
fn break_cycles(description: &mut Description, log: &Log) {
    let mut states = vec![State::New; description.objects.len()];
    for root in 0..description.objects.len() {
        if states[root] != State::New {
            continue;
        }
        states[root] = State::Open;
        let mut path = vec![Step { object: root, next: 0, depth: 0 }];
        while let Some(step) = path.last_mut() {
            let (object, next) = (step.object, step.next);
            let Some(property) = description.objects[object].properties.get(next) else {
                let depth = step.depth;
                states[object] = State::Done(depth);
                path.pop();
                if let Some(parent) = path.last_mut() {
                    parent.depth = parent.depth.max(depth + 1);
                }
                continue;
            };
            step.next += 1;
            let (Value::Object(child), span) = (&property.value, property.span) else { continue };
            let child = *child;
            let problem = match states[child] {
                State::New => {
                    states[child] = State::Open;
                    path.push(Step { object: child, next: 0, depth: 0 });
                    continue;
                }
                State::Open => {
                    format!("objects refer to each other: {}", cycle(description, &path, child))
                }
                State::Done(depth) => {
                    step.depth = step.depth.max(depth + 1);
                    continue;
                }
            };
            log.error(span, problem, None);
            description.objects[object].properties[next].value = Value::Broken;
        }
        cut_deep_chains(description, &mut states, root, log);
    }
}

/// Chains that were walked from their beginning are measured only at their end. One message is
/// enough: every object on a long chain begins a long chain.
fn cut_deep_chains(
    description: &mut Description,
    states: &mut [State],
    root: ObjectIndex,
    log: &Log,
) {
    if !matches!(states[root], State::Done(depth) if depth > MAX_NESTING) {
        return;
    }
    let mut told = false;
    for property in &mut description.objects[root].properties {
        let Value::Object(child) = property.value else { continue };
        if matches!(states[child], State::Done(depth) if depth + 1 > MAX_NESTING) {
            if !told {
                let message = format!("objects are nested deeper than {MAX_NESTING}");
                log.error(property.span, message, None);
                told = true;
            }
            property.value = Value::Broken;
        }
    }
    states[root] = State::Done(0);
}

/// `a -> b -> a`.
fn cycle(description: &Description, path: &[Step], first: ObjectIndex) -> String {
    let begin = path.iter().position(|s| s.object == first).unwrap_or(0);
    let indices = path[begin..].iter().map(|s| s.object).chain([first]);
    let names: Vec<String> = indices
        .map(|i| {
            let object = &description.objects[i];
            object.id.as_deref().map_or_else(|| format!("<{}>", object.tag.name()), short)
        })
        .collect();
    if names.len() > 12 {
        let (head, tail) = (&names[..5], &names[names.len() - 5..]);
        return format!("{} -> … -> {}", head.join(" -> "), tail.join(" -> "));
    }
    names.join(" -> ")
}
