//! Closed forms on points and poses.
