#pragma once

namespace imprint {

inline constexpr int kPostgresSchemaVersion = 1;

/// Makes schema version 1. `message` and `result` are the tables of fusion's own database, by `store`, the database
/// they come from; `session` is what a person or a chart asks for.
inline constexpr const char* kPostgresSchema = R"sql(
CREATE SCHEMA imprint;
CREATE TABLE imprint.version (number integer NOT NULL);
INSERT INTO imprint.version VALUES (1);
CREATE TABLE imprint.store (
  store text PRIMARY KEY,
  site text NOT NULL,
  line text NOT NULL,
  since timestamptz NOT NULL DEFAULT now()
);
CREATE TABLE imprint.message (
  store text NOT NULL REFERENCES imprint.store,
  id bigint NOT NULL,              -- the order of receipt
  session text NOT NULL,
  observation bigint NOT NULL,
  received_ns bigint NOT NULL,     -- since the Unix epoch
  camera text,                     -- NULL: a trigger
  boot_id text,                    -- 16 hex digits
  sequence numeric(20),
  late boolean NOT NULL,           -- its observation had been evaluated without it
  clock_offset_ns bigint,          -- its node's clock minus fusion's; NULL: not known
  bytes bytea NOT NULL,            -- as it came over the wire: proto/imprint.proto
  PRIMARY KEY (store, id)
);
CREATE INDEX message_session ON imprint.message (session);
CREATE TABLE imprint.result (
  store text NOT NULL REFERENCES imprint.store,
  session text NOT NULL,
  complete boolean NOT NULL,
  error text NOT NULL,             -- why there is no measurement
  result json,                     -- imprint.result/1; NULL: no measurement
  made_ns bigint NOT NULL,         -- since the Unix epoch
  revision bigint NOT NULL,
  PRIMARY KEY (store, session)
);
CREATE INDEX result_revision ON imprint.result (store, revision);
CREATE VIEW imprint.session AS
SELECT site, line, session, to_timestamp(made_ns / 1e9) AS made_at, complete, error,
       (result->>'length_mm')::float8 AS length_mm,
       (result->>'max_deflection_mm')::float8 AS max_deflection_mm,
       coalesce(json_array_length(result->'observations'), 0) AS observations, result, store, revision
FROM imprint.result JOIN imprint.store USING (store);
)sql";

}  // namespace imprint
