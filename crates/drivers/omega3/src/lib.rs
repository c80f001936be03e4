//! The Force Dimension omega.3 as an indenter: libdrd loaded at run time, owned by one thread.
