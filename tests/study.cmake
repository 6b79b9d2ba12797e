ringlet_test(study ringlet::study ringlet::kernels_headers ringlet::oracle nlohmann_json::nlohmann_json)
