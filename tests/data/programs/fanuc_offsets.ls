/PROG  FANUC_OFFSETS
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "P[1] in a comment";
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  UFRAME_NUM=0 ;
   2:  UTOOL_NUM=1 ;
   3:J P[1] 100% FINE ;
   4:L P[2] 500mm/sec CNT100 Offset,PR[5] ;
   5:L P[2] 500mm/sec CNT100 ;
   6:L P[3] 500mm/sec FINE INC ;
   7:L P[4] 500mm/sec FINE Tool_Offset,PR[6] ;
   8:L PR[7] 500mm/sec FINE ;
   9:L P[R[1]] 500mm/sec FINE ;
  10:  P[5]=LPOS ;
  11:L P[5] 500mm/sec FINE ;
  12:L P[6] 500mm/sec FINE ;
  13:L P[77] 500mm/sec FINE ;
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
	X =    818.715  mm,	Y =    147.321  mm,	Z =    656.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    818.715  mm,	Y =    147.321  mm,	Z =    655.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    818.715  mm,	Y =    147.321  mm,	Z =    654.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    818.715  mm,	Y =    147.321  mm,	Z =    653.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X = ********  mm,	Y = ********  mm,	Z = ********  mm,
	W = ******** deg,	P = ******** deg,	R = ******** deg
};
/END
