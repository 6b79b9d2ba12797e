ringlet_test(solids ringlet::solids)
