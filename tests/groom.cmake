ringlet_test(groom ringlet::groom ringlet_hdf5 TBB::tbb)
