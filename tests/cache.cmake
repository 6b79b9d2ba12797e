ringlet_test(cache ringlet::cache ringlet_hdf5)
