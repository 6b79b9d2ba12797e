# Scenes made in code, run in process: what is hard stays bounded (tests/stability/scenario.h).
ringlet_test(stability ringlet::pipeline ringlet::oracle TBB::tbb nlohmann_json::nlohmann_json fmt::fmt-header-only)
