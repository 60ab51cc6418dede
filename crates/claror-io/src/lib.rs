//! Files of claror: see the modules.
