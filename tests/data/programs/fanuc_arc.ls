/PROG  FANUC_ARC
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "P[1] in a comment";
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:J P[1] 100% FINE ;
   2:L P[2] 500mm/sec FINE ;
   3:C P[3]
    :  P[4] 100mm/sec FINE ;
/POS
P[1]{
   GP1:
    UF : 0, UT : 1,    
	J1=    0.000 deg,	J2=    10.000 deg,	J3=    -10.000 deg,
	J4=    0.000 deg,	J5=    -60.000 deg,	J6=    0.000 deg
};
P[2]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    800.000  mm,	Y =   -100.000  mm,	Z =    650.000  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    850.000  mm,	Y =      0.000  mm,	Z =    650.000  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    800.000  mm,	Y =    100.000  mm,	Z =    650.000  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
/END
