ringlet_test(solids ringlet::solids ringlet::oracle TBB::tbb fmt::fmt-header-only)
