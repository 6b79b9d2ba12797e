ringlet_test(pipeline ringlet::pipeline ringlet::oracle TBB::tbb nlohmann_json::nlohmann_json)
