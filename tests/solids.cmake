ringlet_test(solids ringlet::solids TBB::tbb fmt::fmt-header-only)
