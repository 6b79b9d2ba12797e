ringlet_test(scene ringlet::scene nlohmann_json::nlohmann_json)
