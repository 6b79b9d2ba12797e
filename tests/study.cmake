ringlet_test(study ringlet::study ringlet::oracle nlohmann_json::nlohmann_json)
