# Writes OUTPUT, a C++ source that holds the text of the file SCHEMA.
file(READ ${SCHEMA} text)
file(WRITE ${OUTPUT} "#include \"scene/schema_text.h\"\n\nnamespace ringlet::scene {\n\n"
  "std::string_view schema_text() {\n  return R\"SCHEMA(${text})SCHEMA\";\n}\n\n}  // namespace ringlet::scene\n")
