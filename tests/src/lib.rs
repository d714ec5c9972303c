//! Tests across plugins live in `tests/tests`.
