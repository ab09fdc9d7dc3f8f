"""The two EMPS records: open loop by the benchmark's protocol, and closed loop; the tables of docs/data_emps.md."""
