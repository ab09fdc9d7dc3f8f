"""The measured logs beside the project, diagnosed as they were published: the tables of docs/data_NAME.md."""
