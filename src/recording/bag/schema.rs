//! How the bytes of a message are laid out, by the schema that the bag carries.
use re_ros_msg::MessageSchema;
use re_ros_msg::message_spec::{ArraySize, BuiltInType, ComplexType, MessageSpecification, Type, message_package};

/// What stands in a message; fields that nobody wants are known only to be skipped.
#[derive(Debug)]
pub(super) enum Layout {
    Builtin(BuiltInType),
    /// `length`: where it is fixed; otherwise it stands before the elements.
    Array {
        element: Box<Layout>,
        length: Option<usize>,
    },
    Message(Vec<Field>),
}

#[derive(Debug)]
pub(super) struct Field {
    pub name: String,
    pub layout: Layout,
    pub is_wanted: bool,
}

/// Most parts that a message may have, and how deep they may nest: a schema that is beyond it is no robot's.
const MOST_PARTS: usize = 20_000;
const DEEPEST: usize = 50;

impl Layout {
    /// The layout of the message type `name` from its definition and those of what it contains (`ros2msg`).
    ///
    /// `wanted`: paths of the fields to keep, `header.stamp`, with all below them.
    pub(super) fn new(name: &str, definition: &[u8], wanted: &[&str]) -> Result<Layout, String> {
        let text = std::str::from_utf8(definition).map_err(|_| "its schema is no text".to_owned())?;
        let schema =
            MessageSchema::parse(name, text).map_err(|error| format!("its schema cannot be read: {error:#}"))?;
        let mut builder = Builder { schema: &schema, wanted, parts: 0 };
        let mut layout = builder.message(&schema.spec, "", 0)?;
        if let Layout::Message(fields) = &mut layout {
            // Behind the last field that is wanted nothing needs to be skipped.
            let end = fields.iter().rposition(|field| field.is_wanted).map_or(0, |last| last + 1);
            fields.truncate(end);
        }
        Ok(layout)
    }
}

struct Builder<'a> {
    schema: &'a MessageSchema,
    wanted: &'a [&'a str],
    parts: usize,
}

impl<'a> Builder<'a> {
    fn message(&mut self, spec: &MessageSpecification, path: &str, depth: usize) -> Result<Layout, String> {
        if depth > DEEPEST {
            return Err("its schema contains itself".to_owned());
        }
        let mut fields = Vec::with_capacity(spec.fields.len());
        for field in &spec.fields {
            let path = if path.is_empty() { field.name.clone() } else { format!("{path}.{}", field.name) };
            let layout = self.layout(spec, &field.ty, &path, depth)?;
            fields.push(Field { name: field.name.clone(), layout, is_wanted: self.is_wanted(&path) });
        }
        Ok(Layout::Message(fields))
    }

    fn layout(
        &mut self,
        scope: &MessageSpecification,
        kind: &Type,
        path: &str,
        depth: usize,
    ) -> Result<Layout, String> {
        self.parts += 1;
        if self.parts > MOST_PARTS {
            return Err(format!("its schema has more than {MOST_PARTS} parts"));
        }
        match kind {
            Type::BuiltIn(builtin) => Ok(Layout::Builtin(builtin.clone())),
            Type::Array { ty, size } => {
                let length = if let ArraySize::Fixed(length) = size { Some(*length) } else { None };
                Ok(Layout::Array { element: Box::new(self.layout(scope, ty, path, depth + 1)?), length })
            }
            Type::Complex(complex) => {
                let spec = self.find(scope, complex)?;
                match spec.underlying_type_if_enum_like() {
                    Ok(Some(builtin)) => Ok(Layout::Builtin(builtin.clone())),
                    _ => self.message(spec, path, depth + 1),
                }
            }
        }
    }

    /// The definition of a part, by package and name: `geometry_msgs/msg/Point` and `geometry_msgs/Point` are the same.
    fn find(&self, scope: &MessageSpecification, complex: &ComplexType) -> Result<&'a MessageSpecification, String> {
        let (package, name) = match complex {
            ComplexType::Absolute { package, name } => (Some(package.as_str()), name),
            ComplexType::Relative { name } => (message_package(&scope.name), name),
        };
        let is_it = |spec: &&MessageSpecification, package: Option<&str>| {
            message_package(&spec.name) == package && spec.name.rsplit('/').next() == Some(name.as_str())
        };
        let schema = self.schema;
        let find = |package: Option<&str>| schema.dependencies.iter().find(|spec| is_it(spec, package));
        // `Header` alone is that of std_msgs.
        find(package)
            .or_else(|| find(Some("std_msgs")))
            .ok_or_else(|| format!("its schema does not define {}/{name}", package.unwrap_or_default()))
    }

    /// True for what is wanted, for all below it and for all above it.
    fn is_wanted(&self, path: &str) -> bool {
        let is_below =
            |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        self.wanted.iter().any(|wanted| is_below(path, wanted) || is_below(wanted, path))
    }
}
