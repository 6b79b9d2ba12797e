ringlet_test(pipeline ringlet::pipeline ringlet::oracle TBB::tbb)
