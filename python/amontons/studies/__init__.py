"""Many runs side by side, one row each in a Parquet file: `sweep`, and studies written as TOML files."""
