//! Roles of a catalogue on PostgreSQL: who may read, annotate, record and administer it.

use crate::catalogue::Catalogue;
use crate::error::CatalogueError;

/// What a person or a bench may do in a catalogue on a server. A file has the rights of its folder instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Role {
    /// Name on the server; `GRANT NAME TO USER` gives it.
    pub name: &'static str,
    /// What its members may do.
    pub may: &'static str,
}

/// All roles, the smallest first.
pub const ROLES: [Role; 4] = [
    Role {
        name: "skinrig_read",
        may: "answer questions",
    },
    Role {
        name: "skinrig_annotate",
        may: "also replace tags and notes (`skinrig catalogue register --annotations`)",
    },
    Role {
        name: "skinrig_record",
        may: "also register sessions, analyses, nights and prototypes",
    },
    Role {
        name: "skinrig_admin",
        may: "also update the schema, and delete the catalogue",
    },
];

impl Catalogue {
    /// Creates the [`ROLES`] that are missing, and gives them their rights on this catalogue. The user of the connection becomes a
    /// member of the last one. Repeating it changes nothing.
    ///
    /// # Errors
    /// [`CatalogueError::Address`] for a file; [`CatalogueError::Denied`] unless the user may create roles and owns the tables.
    pub fn create_roles(&mut self) -> Result<(), CatalogueError> {
        #[cfg(feature = "postgres")]
        if matches!(self.db, crate::db::Db::Postgres(_)) {
            let statement = self.db.execute(include_str!("roles.sql"), &[]);
            let done = self.runtime.block_on(statement);
            return done
                .map(drop)
                .map_err(|e| CatalogueError::sql(&self.place, "creating its roles", e));
        }
        Err(CatalogueError::Address {
            place: self.place.clone(),
            expected: "a database of a PostgreSQL server",
            found: "a file: whoever may write its folder may change it".to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::MIGRATIONS;

    #[test]
    fn every_table_of_the_schema_has_its_rights() {
        let sql = include_str!("roles.sql");
        let granted = |begin: &str, role: &str| {
            let (_, rest) = sql.split_once(begin).unwrap();
            let (names, _) = rest.split_once(role).unwrap();
            names
                .split([',', ' ', '\n'])
                .filter(|w| !w.is_empty())
                .collect::<Vec<_>>()
        };
        let read = granted("GRANT SELECT ON", "TO skinrig_read");
        let write = granted("GRANT INSERT, UPDATE, DELETE ON", "TO skinrig_record");
        let schema = MIGRATIONS.map(|(.., sql)| sql).concat();
        let tables = schema.split("CREATE TABLE ").skip(1);
        let tables: Vec<&str> = tables
            .filter_map(|rest| rest.split_whitespace().next())
            .collect();
        assert!(tables.len() > 15, "{tables:?}");
        for table in tables {
            assert!(read.contains(&table) && write.contains(&table), "{table}");
            let owner = format!("ALTER TABLE {table} OWNER TO skinrig_admin;");
            assert!(sql.contains(&owner), "{table}");
        }
    }

    #[test]
    fn the_statements_create_these_roles() {
        let sql = include_str!("roles.sql");
        let created = ROLES.map(|role| format!("'{}'", role.name)).join(", ");
        assert!(sql.contains(&format!("ARRAY[{created}]")), "{created}");
        let known = ROLES.map(|role| sql.matches(role.name).count());
        let all = sql.matches("skinrig_").count();
        assert_eq!(all, known.iter().sum::<usize>(), "no other roles");
    }
}
