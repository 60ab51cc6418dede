//! Scene files: the Mitsuba 3 XML dialect.
