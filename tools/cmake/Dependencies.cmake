# Every library comes from the distribution's packages (tools/install-packages lists them).
find_package(Threads REQUIRED)
find_package(TBB CONFIG REQUIRED)  # before OpenVDB, whose own finder misses it
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(assimp 5.2 REQUIRED)
find_package(nanoflann 1.4 REQUIRED)

set(HDF5_PREFER_PARALLEL FALSE)
set(HDF5_USE_STATIC_LIBRARIES ON)  # the shared one drags in some thirty libraries (tools/bundle)
enable_language(C)  # FindHDF5 compiles a probe
find_package(HDF5 REQUIRED COMPONENTS C)
add_library(ringlet_hdf5 INTERFACE)  # the serial library with what its static archive needs, and nothing unused
target_link_options(ringlet_hdf5 INTERFACE -Wl,--as-needed)
target_link_libraries(ringlet_hdf5 INTERFACE HDF5::HDF5)

list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_CXX_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB 10 REQUIRED COMPONENTS openvdb)
if(RINGLET_TESTS)
  find_package(GTest REQUIRED)
  find_package(benchmark REQUIRED)
endif()
