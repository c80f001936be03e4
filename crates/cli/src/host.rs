//! Names of this machine and its user.

use crate::remote::MOST_NAME_CHARS;

/// Login name of the user; `operator` if unknown.
pub(crate) fn user_name() -> String {
    let name = ["USER", "LOGNAME", "USERNAME"]
        .into_iter()
        .find_map(|key| std::env::var(key).ok().filter(|v| !v.is_empty()));
    let name = name.unwrap_or_else(|| "operator".to_owned());
    name.chars()
        .filter(|c| !c.is_control())
        .take(MOST_NAME_CHARS)
        .collect()
}

/// Host name of the machine; `unknown` if the system has none.
pub(crate) fn host_name() -> String {
    std::fs::read_to_string("/etc/hostname")
        .ok()
        .or_else(|| std::env::var("HOSTNAME").ok())
        .or_else(|| std::env::var("COMPUTERNAME").ok())
        .map(|n| n.trim().to_owned())
        .filter(|n| !n.is_empty())
        .unwrap_or_else(|| "unknown".into())
}
