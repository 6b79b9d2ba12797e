# Reference implementations that the kernels are judged by: Eigen and nothing of ours.
add_library(ringlet_oracle STATIC ${CMAKE_CURRENT_LIST_DIR}/oracle/ams_reference.cpp
                                  ${CMAKE_CURRENT_LIST_DIR}/oracle/mass_spring_reference.cpp
                                  ${CMAKE_CURRENT_LIST_DIR}/oracle/mesh_distance.cpp)
add_library(ringlet::oracle ALIAS ringlet_oracle)
target_include_directories(ringlet_oracle PUBLIC ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(ringlet_oracle PUBLIC Eigen3::Eigen PRIVATE ringlet_flags)

ringlet_test(oracle ringlet::oracle)
